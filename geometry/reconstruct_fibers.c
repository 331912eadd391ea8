/* Step "fibers": subvolumes, centers, chains, joins, smoothing, radius. */
#include "geometry/reconstruct.h"

#include "geometry/fibers/centers.h"
#include "geometry/fibers/joining.h"
#include "geometry/fibers/linking.h"
#include "geometry/fibers/radius.h"
#include "geometry/fibers/smoothing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MIN_PIECE = 4 }; /* centers in a chain before joining */

struct fiber_job {
    const struct volume *v;
    const struct direction_volume *d;
    struct reconstruct_option *o;
    struct thread_pool *pool;
    struct reconstruct_report *report;
    struct progress inner;
    const struct progress *outer;
    double from, share;
    double diameter; /* voxels */
};

static void report_part(void *context, double fraction)
{
    const struct fiber_job *job = context;
    progress_report(job->outer, job->from + job->share * fraction);
}

static void enter_part(struct fiber_job *job, double from, double to)
{
    job->from = from;
    job->share = to - from;
}

static status find_chains(struct fiber_job *job, struct polyline_set *chains, struct error *err)
{
    uint8_t *mask = malloc(volume_n_voxel(job->v->n));
    if (mask == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot trace fibers: out of memory");
    status s = class_mask(job->d, job->pool, mask, job->report->n_class_voxel, err);
    for (int axis = 0; axis < 3 && s == STATUS_OK; axis++) {
        struct center_list list = {0};
        enter_part(job, 0.2 * axis, 0.2 * axis + 0.2);
        s = centers_detect(job->v, job->d, mask, axis, job->diameter, job->pool, &job->inner, &list, err);
        if (s != STATUS_OK) break;
        job->report->n_center[axis] = list.first[list.n_slice];
        s = centers_link(&list, axis, job->o->link_sigma_voxel, job->diameter, MIN_PIECE, chains,
                         &job->report->n_chain[axis], err);
        center_list_release(&list);
    }
    free(mask);
    return s;
}

/* Smooth every line, and drop those under min_vertex. */
static status smooth_and_drop(struct fiber_job *job, const struct polyline_set *in, struct polyline_set *out,
                              struct error *err)
{
    size_t longest = 0;
    for (size_t l = 0; l < in->n_line; l++)
        if (polyline_length(in, l) > longest) longest = polyline_length(in, l);
    double *work = malloc(4 * (longest + 1) * sizeof *work);
    if (work == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot smooth fibers: out of memory");
    status s = STATUS_OK;
    for (size_t l = 0; l < in->n_line && s == STATUS_OK; l++) {
        size_t n = polyline_length(in, l);
        if (n < job->o->min_vertex || n < 3) {
            job->report->n_short_dropped[in->axis[l]]++;
            continue;
        }
        polyline_smooth(in->vertex + in->first[l], n, job->o->smooth_alpha, work);
        s = polyline_begin(out, in->axis[l], err);
        for (size_t i = in->first[l]; i < in->first[l + 1] && s == STATUS_OK; i++) s = polyline_add(out, in->vertex[i], err);
    }
    free(work);
    return s;
}

/* Fibers that end within half a slice of a face reach it: the last segment is prolonged. Ends are first or last vertices. */
static void reach_face(struct polyline_set *p, size_t line, bool last, const size_t n[3])
{
    size_t m = polyline_length(p, line), back = m < 5 ? m - 1 : 4;
    float *x = p->vertex[last ? p->first[line + 1] - 1 : p->first[line]];
    const float *y = p->vertex[last ? p->first[line + 1] - 1 - back : p->first[line] + back];
    float t[3], nearest = INFINITY;
    for (int a = 0; a < 3; a++) t[a] = (x[a] - y[a]) / (float)back;
    for (int a = 0; a < 3; a++) { /* steps of t until a face is met */
        float room = t[a] > 0.0f ? (float)n[a] - x[a] : x[a], speed = fabsf(t[a]);
        if (speed > 0.2f && room / speed < nearest) nearest = room / speed;
    }
    if (nearest > 0.0f && nearest <= 1.5f)
        for (int a = 0; a < 3; a++) x[a] += nearest * t[a];
}

/* The class of a fiber is the axis along which it moves most. */
static void classify(struct polyline_set *p)
{
    for (size_t l = 0; l < p->n_line; l++) {
        float moved[3] = {0.0f, 0.0f, 0.0f};
        for (size_t i = p->first[l]; i + 1 < p->first[l + 1]; i++)
            for (int a = 0; a < 3; a++) moved[a] += fabsf(p->vertex[i + 1][a] - p->vertex[i][a]);
        p->axis[l] = moved[0] >= moved[1] && moved[0] >= moved[2] ? 0 : moved[1] >= moved[2] ? 1 : 2;
    }
}

static status make_lines(struct fiber_job *job, struct polyline_set *lines, struct error *err)
{
    struct polyline_set chains, single, joined;
    struct join_counts counts = {0};
    polyline_set_init(&chains);
    polyline_set_init(&single);
    polyline_set_init(&joined);
    status s = find_chains(job, &chains, err);
    if (s == STATUS_OK)
        s = polylines_remove_duplicates(&chains, job->v->n, job->diameter, MIN_PIECE, &single, &counts, err);
    if (s == STATUS_OK) s = polylines_join(&single, job->v, job->diameter, job->o->eps_d, &joined, &counts, err);
    if (s == STATUS_OK) s = smooth_and_drop(job, &joined, lines, err);
    if (s == STATUS_OK) {
        job->report->n_gap_bridged = counts.n_gap_bridged;
        job->report->n_joined = counts.n_joined;
        classify(lines);
        for (size_t l = 0; l < lines->n_line; l++) {
            reach_face(lines, l, false, job->v->n);
            reach_face(lines, l, true, job->v->n);
        }
        if (lines->n_line == 0)
            s = error_set_field(err, STATUS_INVALID, "volume.files",
                                "cannot find fibers: none of the chains of centers has %zu vertices", job->o->min_vertex);
    }
    polyline_set_release(&chains);
    polyline_set_release(&single);
    polyline_set_release(&joined);
    return s;
}

static status find_radius(struct fiber_job *job, const struct polyline_set *lines, struct error *err)
{
    struct distance_histogram *h = malloc(sizeof *h);
    if (h == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber radius: out of memory");
    double voxel_m = job->v->voxel_size_m[0];
    enter_part(job, 0.65, 1.0);
    status s = distance_histogram_measure(job->v, lines, job->o->eps_d, fmax(4.0, 1.0 * job->diameter), job->pool, &job->inner,
                                          h, err);
    if (s == STATUS_OK) {
        double score, dice, all = radius_best_score(h, 7u, &score, &dice);
        job->report->dice = dice;
        for (unsigned a = 0; a < 3; a++) {
            double own_score = score, r = job->o->radius_per_axis ? radius_best_score(h, 1u << a, &own_score, &dice) : all;
            if (isnan(job->o->radius_m[a])) job->o->radius_m[a] = (r > 0.0 ? r : all) * voxel_m;
            job->report->radius_m[a] = job->o->radius_m[a];
            job->report->radius_score[a] = own_score;
        }
    }
    free(h);
    return s;
}

static status to_fiber_set(const struct fiber_job *job, const struct polyline_set *lines, struct fiber_set *f,
                           struct error *err)
{
    double voxel_m = job->v->voxel_size_m[0];
    status s = fiber_set_reserve(f, lines->n_line, lines->n_vertex, err);
    if (s != STATUS_OK) return s;
    memcpy(f->first_vertex, lines->first, (lines->n_line + 1) * sizeof *f->first_vertex);
    for (size_t i = 0; i < lines->n_vertex; i++)
        for (size_t a = 0; a < 3; a++) f->position_m[3 * i + a] = (float)((double)lines->vertex[i][a] * voxel_m);
    for (size_t l = 0; l < lines->n_line; l++) {
        f->axis_class[l] = lines->axis[l];
        f->radius_m[l] = (float)job->o->radius_m[lines->axis[l]];
    }
    f->tile_size_m[0] = (double)job->v->n[0] * voxel_m;
    f->tile_size_m[1] = (double)job->v->n[1] * voxel_m;
    job->report->n_fiber = f->n_fiber;
    job->report->n_vertex = f->n_vertex;
    job->report->total_length_m = fiber_set_length_m(f);
    return fiber_set_validate(f, err);
}

status reconstruct_fibers(const struct volume *v, const struct direction_volume *d, struct reconstruct_option *o,
                          struct thread_pool *pool, const struct progress *progress, struct fiber_set *f,
                          struct reconstruct_report *report, struct error *err)
{
    struct fiber_job job = {.v = v, .d = d, .o = o, .pool = pool, .report = report, .outer = progress};
    job.inner = (struct progress){report_part, &job, progress != NULL ? progress->cancel : NULL};
    job.diameter = report->fiber_diameter_voxel;
    struct polyline_set lines;
    polyline_set_init(&lines);
    fiber_set_init(f);
    for (int a = 0; a < 3; a++) report->n_short_dropped[a] = 0;
    if (!(job.diameter > 0.0))
        return error_set(err, STATUS_INVALID, "cannot trace fibers: the report does not hold the fiber diameter");
    status s = make_lines(&job, &lines, err);
    if (s == STATUS_OK) s = find_radius(&job, &lines, err);
    if (s == STATUS_OK) s = to_fiber_set(&job, &lines, f, err);
    polyline_set_release(&lines);
    if (s != STATUS_OK) fiber_set_release(f);
    return s;
}
