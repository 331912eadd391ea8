/* Step "fibers": subvolumes, centers, chains, joining, smoothing and radius. */
#include "base/angle.h"
#include "base/option_id.h"
#include "geometry/reconstruct.h"

#include "geometry/fibers/lines/disagreement.h"
#include "geometry/fibers/lines/growing.h"
#include "geometry/fibers/lines/joining.h"
#include "geometry/fibers/lines/kinks.h"
#include "geometry/fibers/lines/line_ends.h"
#include "geometry/fibers/lines/linking.h"
#include "geometry/fibers/shape/axes/axis_fit.h"
#include "geometry/fibers/shape/axes/flat_fit.h"
#include "geometry/fibers/shape/radius.h"
#include "geometry/fibers/shape/smoothing.h"
#include "geometry/fibers/slices/centers.h"
#include "geometry/trace_grid.h"
#include "geometry/volume/volume_rescale.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MIN_PIECE = 4,  /* least number of centers in a chain before joining */
    N_REPAIR = 2,   /* rounds of growing, joining and cutting */
    N_CENTER = 2,   /* rounds of fitting pieces of lines to the scan */
    N_FIT = 4,      /* rounds of fitting whole lines */
    MAX_GROWTH = 64 /* voxels by which an end may grow */
};

/* Turn of a kink relative to the usual turn. Less cuts fibers of plain weaves into pieces; more keeps jumps between
 * fibers. */
#define OVER_USUAL_TURN 2.1
#define END_DIAMETERS 1.0 /* length at an end, in diameters, that may be wrong */
/* Distance of the axes of neighbours over the sum of their radii, below which one of two fitted lines is wrong: fibers
 * do not pass through each other. */
#define TOUCHING 0.85
#define MAX_DISAGREEMENT_RAD (30.0 * RAD_PER_DEG)

struct fiber_job {
    const struct volume *v;
    const struct direction_volume *d;
    struct reconstruct_option *o;
    struct thread_pool *pool;
    struct reconstruct_report *report;
    struct progress inner;
    struct progress_part part;   /* progress that inner reports to */
    double diameter;             /* voxels */
    double independent;          /* of the voxels of v (axis_profile.h) */
    struct axis_profile profile; /* of the lines so far */
};

/* The shares of the parts are means of those of the time that they take on a phantom, on a scan of cotton and on one of
 * a weave. */
static void enter_part(struct fiber_job *job, double from, double to)
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

static status find_chains(struct fiber_job *job, struct polyline_set *chains, struct error *err)
{
    struct subvolumes sub;
    status s = subvolumes_init(&sub, job->d, job->pool, err);
    memcpy(job->report->n_class_voxel, sub.n_class_voxel, sizeof sub.n_class_voxel);
    for (int a = 0; a < 3; a++) job->report->n_center[a] = job->report->n_chain[a] = 0;
    for (int i = 0; i < N_SLICE_FRAME && s == STATUS_OK; i++) {
        struct center_list list = {0};
        struct slice_frame frame;
        size_t n_chain = 0;
        slice_frame_init(&frame, i, job->v->n);
        enter_part(job, 0.12 * i / N_SLICE_FRAME, 0.12 * (i + 1) / N_SLICE_FRAME);
        const struct center_search search = {job->v, job->d, &sub, &frame, job->diameter};
        s = centers_detect(&search, job->pool, &job->inner, &list, err);
        if (s != STATUS_OK) break;
        s = centers_link(&list, &frame, job->o->link_sigma_voxel, job->diameter, MIN_PIECE, chains, &n_chain, err);
        job->report->n_center[frame_axis(&frame)] += list.first[list.n_slice];
        job->report->n_chain[frame_axis(&frame)] += n_chain;
        center_list_release(&list);
    }
    subvolumes_release(&sub);
    return s;
}

/* Sets the class of each fiber: the axis along which it extends most. */
static void classify(struct polyline_set *p)
{
    for (size_t l = 0; l < p->n_line; l++) {
        float moved[3] = {0.0f, 0.0f, 0.0f};
        for (size_t i = p->first[l]; i + 1 < p->first[l + 1]; i++)
            for (int a = 0; a < 3; a++) moved[a] += fabsf(p->vertex[i + 1][a] - p->vertex[i][a]);
        p->axis[l] = moved[0] >= moved[1] && moved[0] >= moved[2] ? 0 : moved[1] >= moved[2] ? 1 : 2;
    }
}

/* Smooths every line, and drops those with fewer than min_vertex vertices. */
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
        s = polyline_add_part(out, in, l, in->first[l], in->first[l + 1], err);
    }
    free(work);
    return s;
}

/* One pass over the pieces: cuts duplicates, lets the ends grow, and joins ends that meet. touching: joining.h. `in` is
 * emptied. */
static status repair_lines(struct fiber_job *job, struct polyline_set *in, bool grow, double touching,
                           struct polyline_set *out, struct join_counts *counts, struct error *err)
{
    struct polyline_set agreeing, single, grown;
    const struct grow_option option = {(float)job->diameter, (float)job->o->eps_d, MAX_GROWTH};
    size_t n_grown = 0, n_cut = 0;
    polyline_set_init(&agreeing);
    polyline_set_init(&single);
    polyline_set_init(&grown);
    status s = polylines_cut_disagreeing(in, job->d, MAX_DISAGREEMENT_RAD, MIN_PIECE, &agreeing, &n_cut, err);
    if (s == STATUS_OK)
        s = polylines_remove_duplicates(&agreeing, job->v->n, job->diameter, touching, MIN_PIECE, &single, counts, err);
    if (s == STATUS_OK && grow) s = polylines_grow(&single, job->v, &option, &grown, &n_grown, err);
    if (s == STATUS_OK)
        s = polylines_join(grow ? &grown : &single, job->v, job->diameter, job->o->eps_d, out, counts, err);
    polyline_set_release(&agreeing);
    polyline_set_release(&single);
    polyline_set_release(&grown);
    polyline_set_release(in);
    return s;
}

static struct axis_profile start_profile(const struct fiber_job *job)
{
    return (struct axis_profile){
        .radius = 0.5 * job->diameter, .radius_spread = 0.3, .blur = 0.8, .high = 1.0, .independent = 1.0};
}

/* Moves lines that are still in pieces towards their axes, and finds their radii. */
static status center(struct fiber_job *job, struct polyline_set *lines, struct error *err)
{
    return polylines_fit(lines, job->v, job->diameter, N_CENTER, &job->profile, job->pool, &job->inner, err);
}

/* Moves lines to where they explain the scan best. `last`: as smoothly as fibers are, with errors for the report. */
static status fit_axes(struct fiber_job *job, struct polyline_set *lines, bool last, struct error *err)
{
    struct axis_profile profile = start_profile(job);
    profile.measured_curvature = last;
    if (last) profile.independent = job->independent;
    const double voxel_m = job->v->voxel_size_m[0];
    struct section_ratio ratio;
    struct polyline_set even, inside;
    polyline_set_init(&even);
    polyline_set_init(&inside);
    status s = polylines_resample(lines, &even, err);
    const struct flat_fit fit = {job->v, job->diameter, N_FIT, MIN_PIECE, job->pool, &job->inner};
    if (s == STATUS_OK) s = polylines_fit_flat(&even, &fit, &profile, &ratio, err);
    if (s == STATUS_OK)
        s = polylines_keep_inside(&even, job->v->n, job->o->min_vertex, &inside, job->report->n_short_dropped, err);
    if (s == STATUS_OK) {
        job->report->axis_position_se_m = profile.position_se * voxel_m;
        job->report->axis_direction_se_rad = profile.direction_se_rad;
        job->report->profile_radius_m = profile.radius * voxel_m;
        job->report->profile_blur_m = profile.blur * voxel_m;
        job->report->radius_spread = profile.radius_spread;
        job->report->axis_ratio = ratio.mean;
        job->report->axis_ratio_spread = ratio.sd;
        job->report->single_radius_se_m = profile.radius_se * profile.radius * voxel_m;
        polyline_set_release(lines);
        *lines = inside;
        polyline_set_init(&inside);
    }
    polyline_set_release(&even);
    polyline_set_release(&inside);
    return s;
}

/* Cuts lines at kinks, where they change to another fiber; in the last pass also removes ends that lie in other
 * fibers. */
static status straighten(struct fiber_job *job, struct polyline_set *lines, bool last, size_t min_vertex,
                         struct error *err)
{
    struct polyline_set out;
    size_t n_cut;
    polyline_set_init(&out);
    status s = polylines_cut_kinks(lines, job->diameter, OVER_USUAL_TURN, min_vertex, last, &out, &n_cut, err);
    if (s == STATUS_OK) {
        polyline_set_release(lines);
        *lines = out;
        polyline_set_init(&out);
    }
    if (s == STATUS_OK && last)
        s = polylines_trim_disagreeing(lines, job->d, MAX_DISAGREEMENT_RAD,
                                       (size_t)(END_DIAMETERS * job->diameter + 0.5), min_vertex, &out, err);
    if (s == STATUS_OK && last) {
        polyline_set_release(lines);
        *lines = out;
        polyline_set_init(&out);
    }
    polyline_set_release(&out);
    return s;
}

/* Finds lines and repairs them, until only the last fit is left. */
static status trace_lines(struct fiber_job *job, struct polyline_set *lines, struct error *err)
{
    struct polyline_set part[3];
    struct join_counts counts = {0};
    for (int i = 0; i < 3; i++) polyline_set_init(&part[i]);
    status s = find_chains(job, &part[0], err);
    enter_part(job, 0.12, 0.14);
    if (s == STATUS_OK) s = repair_lines(job, &part[0], false, 0.0, &part[1], &counts, err);
    for (int round = 0; round < N_REPAIR && s == STATUS_OK; round++) { /* grow and join, then cut wrong parts */
        const double from = 0.14 + 0.2 * round / N_REPAIR;
        enter_part(job, from, from + 0.14 / N_REPAIR);
        s = center(job, &part[1], err);
        if (s == STATUS_OK) s = repair_lines(job, &part[1], true, 0.0, &part[2], &counts, err);
        enter_part(job, from + 0.14 / N_REPAIR, from + 0.2 / N_REPAIR);
        if (s == STATUS_OK) s = center(job, &part[2], err);
        if (s == STATUS_OK) s = repair_lines(job, &part[2], false, 0.0, &part[1], &counts, err);
    }
    if (s == STATUS_OK) s = repair_lines(job, &part[1], true, 0.0, &part[0], &counts, err);
    if (s == STATUS_OK) {
        classify(&part[0]); /* from classes of subvolumes to axis classes */
        enter_part(job, 0.34, 0.35);
        s = smooth_and_drop(job, &part[0], lines, err);
    }
    enter_part(job, 0.35, 0.4);
    if (s == STATUS_OK) s = center(job, lines, err);
    enter_part(job, 0.4, 0.52);
    if (s == STATUS_OK) s = fit_axes(job, lines, false, err);
    if (s == STATUS_OK) s = straighten(job, lines, false, MIN_PIECE, err);
    /* lines on the fibers' axes are easier to distinguish and to join, and their radii are known */
    if (s == STATUS_OK) s = repair_lines(job, lines, true, TOUCHING, &part[1], &counts, err);
    enter_part(job, 0.52, 0.54);
    if (s == STATUS_OK) s = smooth_and_drop(job, &part[1], &part[2], err);
    if (s == STATUS_OK) s = repair_lines(job, &part[2], true, TOUCHING, lines, &counts, err);
    job->report->n_gap_bridged = counts.n_gap_bridged;
    job->report->n_joined = counts.n_joined;
    for (int i = 0; i < 3; i++) polyline_set_release(&part[i]);
    return s;
}

/* Fits whole lines for the last time and drops what deviates. */
static status finish_lines(struct fiber_job *job, struct polyline_set *lines, struct error *err)
{
    enter_part(job, 0.54, 0.67);
    status s = fit_axes(job, lines, true, err);
    return s == STATUS_OK ? straighten(job, lines, true, job->o->min_vertex, err) : s;
}

/* Finds lines in voxels of `edge` times those of the scan. The last fit is to the finer of both grids. The lines are in
 * voxels of the scan. */
static status trace_rescaled(const struct fiber_job *job, double edge, struct polyline_set *lines, struct error *err)
{
    struct volume grid = {0};
    struct direction_volume direction = {0};
    struct fiber_job on_grid = *job;
    size_t n_material, n_kept;
    on_grid.inner = progress_of_part(&on_grid.part);
    const struct progress quiet = progress_silent(&on_grid.inner);
    status s = volume_rescale(job->v, edge, job->pool, &quiet, &grid, err);
    if (s == STATUS_OK)
        s = direction_volume_rescale(job->d, &grid, job->o->eps_d, job->pool, &direction, &n_material, &n_kept, err);
    on_grid.v = &grid;
    on_grid.d = &direction;
    on_grid.diameter = job->diameter / edge;
    on_grid.independent = fmin(1.0, edge * edge * edge);
    on_grid.profile = start_profile(&on_grid);
    if (s == STATUS_OK) s = trace_lines(&on_grid, lines, err);
    if (s == STATUS_OK && edge < 1.0) s = finish_lines(&on_grid, lines, err);
    trace_grid_rescale_lines(lines, edge);
    direction_volume_release(&direction);
    volume_release(&grid);
    return s;
}

static status make_lines(struct fiber_job *job, struct polyline_set *lines, struct error *err)
{
    const double edge = job->report->trace_edge_voxel;
    status s = edge == 1.0 ? trace_lines(job, lines, err) : trace_rescaled(job, edge, lines, err);
    if (s == STATUS_OK && edge >= 1.0) s = finish_lines(job, lines, err);
    if (s != STATUS_OK) return s;
    classify(lines);
    polylines_reach_faces(lines, job->v, job->o->eps_d, END_DIAMETERS * job->diameter);
    if (lines->n_line == 0)
        s = error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                            "cannot find fibers: none of the chains of centers has %zu vertices", job->o->min_vertex);
    return s;
}

/* Mean radius of the lines by length, voxels. */
static double mean_radius(const struct polyline_set *lines)
{
    double sum = 0.0, length = 0.0;
    for (size_t l = 0; l < lines->n_line; l++) {
        sum += (double)polyline_length(lines, l) * (double)lines->radius[l];
        length += (double)polyline_length(lines, l);
    }
    return length > 0.0 ? sum / length : 0.0;
}

static status find_radius(struct fiber_job *job, struct polyline_set *lines, struct error *err)
{
    /* the last one is the sum of the others */
    struct distance_histogram *part = malloc((RADIUS_PARTS + 1) * sizeof *part), *all;
    struct reconstruct_report *report = job->report;
    struct radius_measure m;
    double voxel_m = job->v->voxel_size_m[0];
    const bool is_given = !isnan(job->o->radius_m[0]);
    if (part == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber radius: out of memory");
    enter_part(job, 0.67, 1.0);
    status s = distance_histogram_measure(job->v, lines, job->o->eps_d, fmax(4.0, 1.25 * job->diameter), job->pool,
                                          &job->inner, part, err);
    if (s == STATUS_OK) s = radius_choose(part, job->o->radius_rule, &m, err);
    if (s == STATUS_OK) {
        all = part + RADIUS_PARTS;
        distance_histogram_sum(part, RADIUS_PARTS, all);
        report->radius_per_axis = m.per_axis;
        for (unsigned a = 0; a < 3; a++) {
            bool given = !isnan(job->o->radius_m[a]);
            if (!given) job->o->radius_m[a] = m.radius_voxel[a] * voxel_m;
            report->radius_m[a] = job->o->radius_m[a];
            report->radius_se_m[a] = given ? NAN : m.se_voxel[a] * voxel_m;
            report->radius_score[a] = radius_score(all, m.per_axis ? 1u << a : 7u, job->o->radius_m[a] / voxel_m);
        }
    }
    for (int a = 0; a < 3; a++) m.radius_voxel[a] = job->o->radius_m[a] / voxel_m;
    if (s == STATUS_OK) polylines_set_radii(lines, &m, !is_given && job->o->radius_rule == RADIUS_AUTO);
    /* edges and mass disagree by the errors of both models, which every fiber shares */
    report->single_radius_se_m =
        hypot(report->single_radius_se_m, mean_radius(lines) * voxel_m - report->profile_radius_m);
    free(part);
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
        f->radius_m[l] = (float)((double)lines->radius[l] * voxel_m);
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
    struct fiber_job job = {.v = v, .d = d, .o = o, .pool = pool, .report = report, .part = {.outer = progress}};
    job.inner = progress_of_part(&job.part);
    job.diameter = report->fiber_diameter_voxel;
    job.independent = 1.0;
    job.profile = start_profile(&job);
    struct polyline_set lines;
    polyline_set_init(&lines);
    fiber_set_init(f);
    for (int a = 0; a < 3; a++) report->n_short_dropped[a] = 0;
    if (!(job.diameter > 0.0))
        return error_set(err, STATUS_INVALID, "cannot trace fibers: the report has no fiber diameter");
    status s = make_lines(&job, &lines, err);
    if (s == STATUS_OK) s = find_radius(&job, &lines, err);
    if (s == STATUS_OK) s = to_fiber_set(&job, &lines, f, err);
    polyline_set_release(&lines);
    if (s != STATUS_OK) fiber_set_release(f);
    return s;
}
