/* The lumens of traced fibers, in the scan whose lumens were not filled. */
#include "geometry/reconstruct/trace_job.h"

#include "geometry/fibers/axes/hollow_fit.h"

/* Error of the model of a hollow fiber, as a density: images of lumens are right to 0.006 to 0.012 (geometry/NOTES.md,
 * "Lumens of single fibers"). */
static const double MODEL_ERROR = 0.01;

status trace_lumens(struct trace_job *job, struct polyline_set *lines, struct error *err)
{
    struct volume scan;
    struct shape_measure measure;
    struct axis_profile profile = trace_start_profile(job);
    if (job->v->filled.n == 0 || lines->shape == NULL || job->report->trace_edge_voxel < 1.0) return STATUS_OK;
    profile.measured_curvature = true;
    profile.model_error = MODEL_ERROR;
    profile.clamp_sd = job->report->noise.mapped_sd;
    status s = volume_copy_unfilled(job->v, &scan, err);
    if (s != STATUS_OK) return s;
    trace_enter_part(job, TRACE_FINISHED_END, TRACE_LUMENS_END);
    const struct hollow_fit fit = {&scan, job->diameter, job->pool, &job->inner};
    s = polylines_fit_hollow(lines, &fit, &profile, &measure, err);
    volume_release(&scan);
    if (s != STATUS_OK) return s;
    trace_state_profile(job, &profile);
    job->shared_radius_se = measure.shared_radius_se;
    job->report->lumens_measured = true;
    return STATUS_OK;
}
