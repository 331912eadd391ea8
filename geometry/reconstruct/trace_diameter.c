#include "geometry/reconstruct/trace_diameter.h"

#include "geometry/diameter/fiber_diameter.h"
#include "geometry/reconstruct/trace_grid.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>
#include <string.h>

enum { N_ROUND = 3, SUM_STEP = 3 /* voxels */ };
/* Edge of the box in diameters, and its bounds in voxels. */
static const double EDGE_DIAMETERS = 10.0, LEAST_EDGE = 48.0, MOST_EDGE = 96.0;
/* Largest ratio of the lines' diameter to the peak's: neighbours that touch lower the scale of the peak by less than a
 * tenth, and lines that are thicker run through several fibers. Lines of thin fibers do so at once, and
 * never raise it. */
static const double MOST_RISE = 1.1;
/* Blur in voxels from which the peak is kept: the filter and the reaches of tracing then fit the blurred width better
 * (geometry/NOTES.md). */
static const double STRONG_BLUR = 1.2;
/* Ratio of the diameters of two rounds up to which they are the same. */
static const double SETTLED = 1.04;

/* Sum of the densities of every third voxel along each axis. */
static double sum_densities(const struct volume *v, const size_t from[3], const size_t n[3])
{
    double sum = 0.0;
    scratch_keep_within(v->space);
    for (size_t k = from[2]; k < from[2] + n[2]; k += SUM_STEP)
        for (size_t j = from[1]; j < from[1] + n[1]; j += SUM_STEP)
            for (size_t i = from[0]; i < from[0] + n[0]; i += SUM_STEP)
                sum += (double)v->density[volume_index(v->n, i, j, k)];
    return sum;
}

/* Finds the box of n voxels with the most material, of a lattice of boxes that covers the volume. */
static void find_fullest(const struct volume *v, const size_t n[3], size_t fullest[3])
{
    size_t n_cell[3];
    double most = -1.0;
    for (int a = 0; a < 3; a++) n_cell[a] = (v->n[a] + n[a] - 1) / n[a];
    for (size_t c = 0; c < volume_n_voxel(n_cell); c++) {
        const size_t cell[3] = {c % n_cell[0], c / n_cell[0] % n_cell[1], c / (n_cell[0] * n_cell[1])};
        size_t from[3];
        for (int a = 0; a < 3; a++) from[a] = n_cell[a] == 1 ? 0 : cell[a] * (v->n[a] - n[a]) / (n_cell[a] - 1);
        const double sum = sum_densities(v, from, n);
        if (sum <= most) continue;
        most = sum;
        memcpy(fullest, from, sizeof from);
    }
}

/* Copies the box of v in which `known` has the most material. */
static status copy_fullest(const struct volume *v, const struct volume *known, double diameter, struct volume *box,
                           struct error *err)
{
    const size_t edge = (size_t)fmin(MOST_EDGE, fmax(LEAST_EDGE, EDGE_DIAMETERS * diameter));
    size_t n[3], from[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++) n[a] = v->n[a] < edge ? v->n[a] : edge;
    find_fullest(known, n, from);
    status s = volume_init_in(box, n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < n[2] && s == STATUS_OK; k++)
        for (size_t j = 0; j < n[1]; j++)
            memcpy(box->density + volume_index(n, 0, j, k),
                   v->density + volume_index(v->n, from[0], from[1] + j, from[2] + k), n[0] * sizeof *box->density);
    return s;
}

/* Returns a diameter from the radius and the blur of a fit, which has the edge of a blurred plane (axis_profile.h).
 * Blur moves the edge of a single cylinder inwards by blur^2 / (2 radius), while neighbours that touch it move it
 * outwards along a part of its outline; on phantoms half of the shift is left. */
static double without_blur(double radius, double blur) { return 2.0 * (radius + 0.25 * blur * blur / radius); }

/* Traces lines by a diameter, with the filter that belongs to it whatever the job's is: then a job that is given the
 * filter another one has chosen finds the same fibers. *found: their mean diameter in voxels; NaN: no fibers are
 * resolved. report: a copy. */
static status trace_once(const struct volume *box, trace_orientation *find, double diameter, struct thread_pool *pool,
                         const struct progress *progress, struct reconstruct_report report, double *found,
                         struct error *err)
{
    struct direction_volume d = {0};
    struct reconstruct_option o;
    struct trace_job job = {.v = box, .d = &d, .o = &o, .pool = pool, .report = &report, .part.outer = progress};
    struct polyline_set lines;
    *found = NAN;
    polyline_set_init(&lines);
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = diameter;
    report.radius_spread = 0.0;
    status s = find(box, &o, pool, progress, &d, &report, err);
    if (s == STATUS_OK) {
        trace_job_start(&job);
        s = trace_scan(&job, false, &lines, err);
    }
    const bool resolved = lines.n_line > 0 && report.radius_spread <= TRACE_MOST_SPREAD;
    if (s == STATUS_OK && resolved && report.profile_blur_m < STRONG_BLUR * box->voxel_size_m[0])
        *found = without_blur(report.profile_radius_m, report.profile_blur_m) / box->voxel_size_m[0];
    direction_volume_release(&d);
    polyline_set_release(&lines);
    return s == STATUS_INVALID ? STATUS_OK : s;
}

status trace_diameter(const struct volume *v, const struct volume *known, trace_orientation *find,
                      struct thread_pool *pool, const struct progress *progress, struct reconstruct_report *report,
                      struct error *err)
{
    struct volume box = {0};
    const struct progress quiet = progress_silent(progress);
    const double peak = report->fiber_diameter_voxel;
    const double most = trace_grid_edge(peak, v->n) < 1.0 ? peak : MOST_RISE * peak;
    double diameter = peak, ratio = INFINITY;
    status s = copy_fullest(v, known, peak, &box, err);
    for (int round = 0; round < N_ROUND && fabs(log(ratio)) > log(SETTLED) && s == STATUS_OK; round++) {
        double found;
        s = trace_once(&box, find, diameter, pool, &quiet, *report, &found, err);
        if (!(found < most && found * FIBER_DIAMETER_FINER > peak)) break;
        ratio = found / diameter;
        diameter = found;
    }
    if (s == STATUS_OK) report->fiber_diameter_voxel = diameter;
    volume_release(&box);
    return s;
}
