#include "optimizer/stages/validation/pipeline_contrast.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/stages/fit/pipeline_trace.h"

#include <math.h>

/* Random numbers that the means (pipeline_validation.c) do not use. */
enum { ITERATION = 2 };
_Static_assert((int)JOB_MAX_TEXTURE_CELLS <= (int)CONFIGURATION_MAX_CELLS, "the renderer takes every texture of a job");

status pipeline_validate_contrast(const struct validation_input *in, size_t i_model, const size_t *n_path,
                                  const struct progress *progress, struct validation *v, struct error *err)
{
    const struct observation_set *contrast = &in->job->rows->contrast;
    struct pipeline_trace trace;
    struct progress_part part;
    double wall_s;
    if (contrast->n == 0) return STATUS_OK;
    status s = pipeline_trace_open(&trace, in->job, in->made, "validation", "contrast.journal", i_model, contrast, err);
    for (uint32_t q = 0; q < 2 && s == STATUS_OK; q++) {
        struct estimator e = estimate_journal_estimator(trace.journal);
        struct progress half = progress_begin_part(&part, progress, 0.5 * q, 0.5);
        struct estimator_call call = {in->fit[i_model].result.param, n_path, ITERATION,
                                      q == 0 ? REPLICA_FINAL_A : REPLICA_FINAL_B, false};
        s = e.run(e.context, &call, &half, v->contrast[q], &wall_s, err);
    }
    pipeline_trace_close(&trace);
    return s;
}

void pipeline_rendered_contrast(const struct validation *v, size_t i, double contrast_rgb[3], double se_rgb[3])
{
    const struct estimate *a = &v->contrast[0][i], *b = &v->contrast[1][i];
    for (int c = 0; c < 3; c++) {
        contrast_rgb[c] = 0.5 * (a->mean[c] + b->mean[c]);
        se_rgb[c] = 0.5 * sqrt(a->var[c] + b->var[c]);
    }
}
