#include "geometry/reconstruct/trace_diameter.h"

#include "geometry/diameter/fiber_diameter.h"
#include "geometry/reconstruct/trace_box.h"
#include "geometry/reconstruct/trace_grid.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>

enum { N_ROUND = 3 };
/* Largest ratio of the lines' diameter to the peak's: neighbours that touch lower the scale of the peak by less than a
 * tenth, and lines that are thicker run through several fibers. Lines of thin fibers do so at once, and
 * never raise it. */
static const double MOST_RISE = 1.1;
/* Blur in voxels from which the peak is kept: the filter and the reaches of tracing then fit the blurred width better
 * (geometry/NOTES.md). */
static const double STRONG_BLUR = 1.2;
/* Ratio of the diameters of two rounds up to which they are the same. */
static const double SETTLED = 1.04;

double trace_diameter_of_lines(const struct reconstruct_report *report, double voxel_m)
{
    const double radius = report->profile_radius_m, blur = report->profile_blur_m;
    return 2.0 * (radius + 0.25 * blur * blur / radius) / voxel_m;
}

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
        *found = trace_diameter_of_lines(&report, box->voxel_size_m[0]);
    direction_volume_release(&d);
    polyline_set_release(&lines);
    return s == STATUS_INVALID ? STATUS_OK : s;
}

status trace_diameter(const struct volume *v, const struct volume *known, trace_orientation *find,
                      struct thread_pool *pool, const struct progress *progress, struct reconstruct_report *report,
                      struct error *err)
{
    struct volume box = {0};
    size_t from[3];
    const struct progress quiet = progress_silent(progress);
    const double peak = report->fiber_diameter_voxel;
    const double most = trace_grid_edge(peak, v->n) < 1.0 ? peak : MOST_RISE * peak;
    double diameter = peak, ratio = INFINITY;
    status s = trace_box_copy(v, known, peak, &box, from, err);
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
