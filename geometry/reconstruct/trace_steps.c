/* The steps that lines are traced by, on one grid. */
#include "geometry/reconstruct/trace_job.h"

#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/lines/disagreement.h"
#include "geometry/fibers/lines/growing.h"
#include "geometry/fibers/lines/linking.h"
#include "geometry/fibers/slices/centers.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* The share of a part is its mean share of the time on a phantom, on a scan of cotton and on one of a weave. */
void trace_enter_part(struct trace_job *job, double from, double to)
{
    job->part.from = from;
    job->part.share = to - from;
}

/* Axis class that a frame's centers are counted under. A diagonal between two axes counts under the first. */
static int frame_axis(const struct slice_frame *f)
{
    int axis = 0;
    for (int a = 1; a < 3; a++)
        if (fabsf(f->w[a]) > fabsf(f->w[axis]) + 0.01f) axis = a;
    return axis;
}

status trace_chains(struct trace_job *job, struct polyline_set *chains, struct error *err)
{
    const int n_frame = job->o->three_subvolumes ? 3 : N_SLICE_FRAME;
    struct subvolumes sub;
    status s = subvolumes_init(&sub, job->d, job->o->three_subvolumes, job->pool, err);
    memcpy(job->report->n_class_voxel, sub.n_class_voxel, sizeof sub.n_class_voxel);
    for (int a = 0; a < 3; a++) job->report->n_center[a] = job->report->n_chain[a] = 0;
    for (int i = 0; i < n_frame && s == STATUS_OK; i++) {
        struct center_list list = {0};
        struct slice_frame frame;
        size_t n_chain = 0;
        slice_frame_init(&frame, i, job->v->n);
        trace_enter_part(job, 0.12 * i / n_frame, 0.12 * (i + 1) / n_frame);
        const struct center_search search = {job->v, job->d, &sub, &frame, job->diameter};
        s = centers_detect(&search, job->pool, &job->inner, &list, err);
        if (s != STATUS_OK) break;
        s = centers_link(&list, &frame, job->o->link_sigma_voxel, job->diameter, TRACE_MIN_PIECE, chains, &n_chain,
                         err);
        job->report->n_center[frame_axis(&frame)] += list.first[list.n_slice];
        job->report->n_chain[frame_axis(&frame)] += n_chain;
        center_list_release(&list);
    }
    subvolumes_release(&sub);
    return s;
}

void trace_classify(struct polyline_set *p)
{
    for (size_t l = 0; l < p->n_line; l++) {
        float moved[3] = {0.0f, 0.0f, 0.0f};
        for (size_t i = p->first[l]; i + 1 < p->first[l + 1]; i++)
            for (int a = 0; a < 3; a++) moved[a] += fabsf(p->vertex[i + 1][a] - p->vertex[i][a]);
        p->axis[l] = moved[0] >= moved[1] && moved[0] >= moved[2] ? 0 : moved[1] >= moved[2] ? 1 : 2;
    }
}

status trace_repair(struct trace_job *job, struct polyline_set *in, bool grow, double touching,
                    struct polyline_set *out, struct join_counts *counts, struct error *err)
{
    struct polyline_set agreeing, single, grown;
    const struct grow_option option = {(float)job->diameter, (float)job->o->eps_d, TRACE_MAX_GROWTH};
    const struct disagreement_option check = {TRACE_DISAGREEMENT_RAD, SIZE_MAX, TRACE_MIN_PIECE, job->pool};
    const struct join_option join = {job->diameter, job->o->eps_d, 0.0, job->pool};
    const size_t *n = job->v->n;
    const struct duplicate_option one = {{n[0], n[1], n[2]}, job->diameter, touching, job->pool};
    size_t n_grown = 0, n_cut = 0;
    polyline_set_init(&agreeing);
    polyline_set_init(&single);
    polyline_set_init(&grown);
    status s = polylines_cut_disagreeing(in, job->d, &check, &agreeing, &n_cut, err);
    if (s == STATUS_OK) s = polylines_remove_duplicates(&agreeing, &one, TRACE_MIN_PIECE, &single, counts, err);
    if (s == STATUS_OK && grow) s = polylines_grow(&single, job->v, &option, &grown, &n_grown, err);
    if (s == STATUS_OK) s = polylines_join(grow ? &grown : &single, job->v, &join, out, counts, err);
    polyline_set_release(&agreeing);
    polyline_set_release(&single);
    polyline_set_release(&grown);
    polyline_set_release(in);
    return s;
}

status trace_join(struct trace_job *job, struct polyline_set *lines, bool grow, struct error *err)
{
    const struct grow_option growth = {(float)job->diameter, (float)job->o->eps_d, TRACE_MAX_GROWTH};
    const struct join_option join = {job->diameter, job->o->eps_d, job->profile.blur, job->pool};
    struct join_counts counts = {.n_gap_bridged = job->report->n_gap_bridged, .n_joined = job->report->n_joined};
    struct polyline_set grown, out;
    size_t n_grown;
    polyline_set_init(&grown);
    polyline_set_init(&out);
    status s = grow ? polylines_grow(lines, job->v, &growth, &grown, &n_grown, err) : STATUS_OK;
    if (s == STATUS_OK) s = polylines_join(grow ? &grown : lines, job->v, &join, &out, &counts, err);
    polyline_set_release(&grown);
    polyline_set_release(lines);
    *lines = out;
    job->report->n_gap_bridged = counts.n_gap_bridged;
    job->report->n_joined = counts.n_joined;
    return s;
}

struct axis_profile trace_start_profile(const struct trace_job *job)
{
    return (struct axis_profile){
        .radius = 0.5 * job->diameter, .radius_spread = 0.3, .blur = 0.8, .high = 1.0, .independent = 1.0};
}

void trace_state_profile(const struct trace_job *job, const struct axis_profile *profile)
{
    struct reconstruct_report *r = job->report;
    const double voxel_m = job->v->voxel_size_m[0];
    r->axis_noise_se_m = r->axis_position_se_m = profile->position_se * voxel_m;
    r->axis_direction_se_rad = profile->direction_se_rad;
    r->profile_radius_m = profile->radius * voxel_m;
    r->profile_blur_m = profile->blur * voxel_m;
    r->radius_spread = profile->radius_spread;
    r->single_radius_se_m = profile->radius_se * profile->radius * voxel_m;
}

status trace_center(struct trace_job *job, struct polyline_set *lines, int n_round, struct error *err)
{
    return polylines_fit(lines, job->v, job->diameter, n_round, &job->profile, job->pool, &job->inner, err);
}
