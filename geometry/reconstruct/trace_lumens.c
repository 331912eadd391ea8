/* The lumens of traced fibers, in the scan whose lumens were not filled; and the inner parts of traced fibers, which
 * are filled where fibers are hollow (reconstruct_lumens.c). */
#include "geometry/reconstruct/trace_job.h"

#include "geometry/fibers/axes/hollow_fit.h"
#include "geometry/volume/volume_unknown.h"

#include <math.h>

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
    volume_unknown_ignore(job->v, &scan);
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

/* Radius of the marked part over the fiber's: lumens have 0.3 to 0.6. More fills gaps beside lines that are off, and
 * 0.75 loses recall (geometry/NOTES.md, "Fibers that were traced are filled"). */
static const float CORE = 0.6f;
static const double LEAST_DIAMETERS = 1.5; /* length of a line that is a fiber */

/* Marks the voxels whose center is within `reach` of a segment from a to b. */
static void mark_segment(const float a[3], const float b[3], float reach, const size_t n[3], uint8_t value,
                         uint8_t *mark)
{
    float u[3], length2 = 0.0f;
    size_t from[3], to[3];
    for (int c = 0; c < 3; c++) {
        const float low = floorf(fminf(a[c], b[c]) - reach), high = ceilf(fmaxf(a[c], b[c]) + reach);
        from[c] = (size_t)fminf(fmaxf(low, 0.0f), (float)n[c]);
        to[c] = (size_t)fminf(fmaxf(high, 0.0f), (float)n[c]);
        u[c] = b[c] - a[c];
        length2 += u[c] * u[c];
    }
    for (size_t k = from[2]; k < to[2]; k++)
        for (size_t j = from[1]; j < to[1]; j++)
            for (size_t i = from[0]; i < to[0]; i++) {
                const size_t at = volume_index(n, i, j, k);
                const float d[3] = {(float)i + 0.5f - a[0], (float)j + 0.5f - a[1], (float)k + 0.5f - a[2]};
                const float dot = d[0] * u[0] + d[1] * u[1] + d[2] * u[2];
                const float t = length2 > 0.0f ? fminf(fmaxf(dot / length2, 0.0f), 1.0f) : 0.0f;
                float distance2 = 0.0f;
                for (int c = 0; c < 3; c++) distance2 += (d[c] - t * u[c]) * (d[c] - t * u[c]);
                if (distance2 <= reach * reach && mark[at] == 0) mark[at] = value;
            }
}

void trace_mark_cores(const struct polyline_set *lines, double diameter, const size_t n[3], uint8_t value,
                      uint8_t *mark)
{
    for (size_t l = 0; l < lines->n_line; l++) {
        if ((double)polyline_length(lines, l) < LEAST_DIAMETERS * diameter) continue;
        for (size_t i = lines->first[l]; i + 1 < lines->first[l + 1]; i++)
            mark_segment(lines->vertex[i], lines->vertex[i + 1], CORE * lines->radius[l], n, value, mark);
    }
}
