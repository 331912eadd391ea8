/* Step "fibers": subvolumes, centers, chains, joining, smoothing and radius. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/fibers/lines/line_ends.h"
#include "geometry/fibers/shape/radius.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static status make_lines(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    status s = trace_scan(job, true, lines, err);
    if (s != STATUS_OK) return s;
    trace_classify(lines);
    polylines_reach_faces(lines, job->v, job->o->eps_d, TRACE_END_DIAMETERS * job->diameter);
    if (lines->n_line == 0)
        return error_set_field(err, STATUS_INVALID, OPTION_SCAN_FILES,
                               "cannot find fibers: none of the chains of centers has %zu vertices",
                               job->o->min_vertex);
    return trace_lumens(job, lines, err);
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

/* Error of radii that all fibers share. Edges and mass disagree by the errors of both models: in dense cloth the edges
 * are right, and around single fibers the mass. Densities of void and fiber are known to some 2 %, so that radii are
 * off by half as much even where both agree. se_voxel: by noise. Hollow fibers have only the radii by the edges. */
static double shared_error(const struct trace_job *job, double mean_voxel, double se_voxel)
{
    static const double DENSITY_ERROR = 0.02, CALIBRATED = 0.8;
    const double edges_voxel = job->report->profile_radius_m / job->v->voxel_size_m[0],
                 by_model = job->report->lumens_measured ? 0.0 : mean_voxel - edges_voxel;
    return CALIBRATED * hypot(hypot(se_voxel, by_model), 0.5 * DENSITY_ERROR * mean_voxel);
}

/* Mean density on the axis of a line. */
static double axis_density(const struct volume *v, const struct polyline_set *lines, size_t l)
{
    double sum = 0.0;
    for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) {
        size_t at[3];
        for (int a = 0; a < 3; a++) at[a] = (size_t)fmin(fmax((double)lines->vertex[i][a], 0.0), (double)v->n[a] - 1.0);
        sum += (double)v->density[volume_index(v->n, at[0], at[1], at[2])];
    }
    return sum / (double)polyline_length(lines, l);
}

/* Error of the radius of a line whose density is not the mean of all: the fit takes less density for a thinner fiber,
 * by 0.3 to 1.1 of the difference on scans of several materials. */
static double density_error(const struct volume *v, const struct polyline_set *lines, size_t l, double mean)
{
    static const double PART = 0.6, NOISE = 0.03;
    return PART * (double)lines->radius[l] * fmax(0.0, fabs(axis_density(v, lines, l) - mean) - NOISE);
}

/* Adds the errors by density to those by noise, of single fibers and along them. Filled lumens have no density. */
static void add_density_errors(struct trace_job *job, struct polyline_set *lines)
{
    struct reconstruct_report *report = job->report;
    double mean = 0.0, square = 0.0, length = 0.0;
    if (report->lumens_measured) return;
    for (size_t l = 0; l < lines->n_line; l++) {
        mean += axis_density(job->v, lines, l) * (double)polyline_length(lines, l);
        length += (double)polyline_length(lines, l);
    }
    for (size_t l = 0; l < lines->n_line; l++) {
        const double error = density_error(job->v, lines, l, mean / length);
        square += error * error * (double)polyline_length(lines, l);
        for (size_t i = lines->first[l]; i < lines->first[l + 1] && lines->shape != NULL; i++)
            if (lines->shape[i].radius_se > 0.0f)
                lines->shape[i].radius_se = hypotf(lines->shape[i].radius_se, (float)error);
    }
    report->single_radius_se_m =
        hypot(report->single_radius_se_m, sqrt(square / fmax(1.0, length)) * job->v->voxel_size_m[0]);
}

/* Adds the shared errors to those by noise: of the classes, of single fibers, and along them. */
static void state_errors(struct trace_job *job, struct polyline_set *lines)
{
    struct reconstruct_report *report = job->report;
    const double voxel_m = job->v->voxel_size_m[0], mean = mean_radius(lines);
    double shared[3], all = 0.0;
    for (int a = 0; a < 3; a++) {
        shared[a] = isnan(report->radius_se_m[a]) ? 0.0 : shared_error(job, mean, report->radius_se_m[a] / voxel_m);
        if (!isnan(report->radius_se_m[a])) report->radius_se_m[a] = shared[a] * voxel_m;
        all = fmax(all, shared[a]);
    }
    report->single_radius_se_m = hypot(report->single_radius_se_m, all * voxel_m);
    for (size_t l = 0; l < lines->n_line && lines->shape != NULL; l++)
        for (size_t i = lines->first[l]; i < lines->first[l + 1]; i++) {
            float *se = &lines->shape[i].radius_se;
            if (*se > 0.0f) *se = hypotf(*se, (float)shared[lines->axis[l]]);
        }
}

static status find_radius(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    /* the last one is the sum of the others */
    struct distance_histogram *part = malloc((RADIUS_PARTS + 1) * sizeof *part), *all;
    struct reconstruct_report *report = job->report;
    struct radius_measure m;
    double voxel_m = job->v->voxel_size_m[0];
    const bool is_given = !isnan(job->o->radius_m[0]);
    if (part == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the fiber radius: out of memory");
    trace_enter_part(job, report->lumens_measured ? TRACE_LUMENS_END : TRACE_FINISHED_END, 1.0);
    status s = distance_histogram_measure(job->v, lines, job->o->eps_d, fmax(4.0, 1.25 * job->diameter), job->pool,
                                          &job->inner, part, err);
    if (s == STATUS_OK) s = radius_choose(part, job->o->radius_rule, &m, err);
    /* the mass belongs to filled lumens, whose walls are thin and not as dense as 1 */
    const bool of_lines = report->lumens_measured && job->o->radius_rule == RADIUS_AUTO;
    if (s == STATUS_OK && of_lines) radius_measure_lines(lines, job->shared_radius_se, &m);
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
    if (s == STATUS_OK) {
        add_density_errors(job, lines);
        state_errors(job, lines);
    }
    free(part);
    return s;
}

status trace_fiber_set(const struct volume *v, const struct polyline_set *lines, struct fiber_set *f, struct error *err)
{
    const double voxel_m = v->voxel_size_m[0];
    status s = fiber_set_reserve(f, lines->n_line, lines->n_vertex, err);
    if (s != STATUS_OK) return s;
    memcpy(f->first_vertex, lines->first, (lines->n_line + 1) * sizeof *f->first_vertex);
    for (size_t i = 0; i < lines->n_vertex; i++)
        for (size_t a = 0; a < 3; a++) f->position_m[3 * i + a] = (float)((double)lines->vertex[i][a] * voxel_m);
    for (size_t l = 0; l < lines->n_line; l++) {
        f->axis_class[l] = lines->axis[l];
        f->radius_m[l] = (float)((double)lines->radius[l] * voxel_m);
    }
    if (lines->shape != NULL) s = fiber_set_add_shapes(f, err);
    for (size_t i = 0; i < lines->n_vertex && f->shape != NULL; i++) {
        f->shape[i] = lines->shape[i];
        f->shape[i].radius = (float)((double)f->shape[i].radius * voxel_m);
        f->shape[i].radius_se = (float)((double)f->shape[i].radius_se * voxel_m);
    }
    f->tile_size_m[0] = (double)v->n[0] * voxel_m;
    f->tile_size_m[1] = (double)v->n[1] * voxel_m;
    return s;
}

static status to_fiber_set(const struct trace_job *job, const struct polyline_set *lines, struct fiber_set *f,
                           struct error *err)
{
    status s = trace_fiber_set(job->v, lines, f, err);
    if (s != STATUS_OK) return s;
    job->report->n_fiber = f->n_fiber;
    job->report->n_vertex = f->n_vertex;
    job->report->total_length_m = fiber_set_length_m(f);
    return fiber_set_validate(f, err);
}

status reconstruct_fibers(const struct volume *v, const struct direction_volume *d, struct reconstruct_option *o,
                          struct thread_pool *pool, const struct progress *progress, struct fiber_set *f,
                          struct reconstruct_report *report, struct error *err)
{
    struct trace_job job = {.v = v, .d = d, .o = o, .pool = pool, .report = report, .part = {.outer = progress}};
    trace_job_start(&job);
    struct polyline_set lines;
    polyline_set_init(&lines);
    fiber_set_init(f);
    for (int a = 0; a < 3; a++) report->n_short_dropped[a] = 0;
    report->lumens_measured = false;
    if (!(job.diameter > 0.0))
        return error_set(err, STATUS_INVALID, "cannot trace fibers: the report has no fiber diameter");
    status s = make_lines(&job, &lines, err);
    if (s == STATUS_OK) s = find_radius(&job, &lines, err);
    if (s == STATUS_OK) s = to_fiber_set(&job, &lines, f, err);
    polyline_set_release(&lines);
    if (s != STATUS_OK) fiber_set_release(f);
    return s;
}
