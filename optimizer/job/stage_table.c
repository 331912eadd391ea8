#include "optimizer/job/stage_table.h"

/* A weight is the share of the wall time in a typical job: one small volume, 16 configurations, default budget, 2
 * cores. */
static const struct pipeline_stage_info stage_table[] = {
    {"volume", "Reading the scan", 0.01, .of_scan = true},
    {"orientation", "Finding local fiber directions", 0.04, .of_scan = true},
    {"fibers", "Tracing fibers", 0.13},
    {"directions", "Transferring fiber directions to the volume", 0.01, .of_scan = true},
    {"scene", "Building the scene", 0.01, .of_model = true},
    {"fit", "Fitting the scattering parameters", 0.50, .of_model = true, .of_fit = true, .of_profile = true},
    {"validation", "Rendering the fitted cloth for every photograph's configuration", 0.15, .of_model = true,
     .of_fit = true},
    {"report", "Writing pictures and results", 0.15, .of_profile = true},
};

const struct pipeline_stage_info *pipeline_stage_table(size_t *n_stage)
{
    *n_stage = sizeof stage_table / sizeof stage_table[0];
    return stage_table;
}

bool pipeline_stage_applies(const struct pipeline_stage_info *stage, enum job_kind kind, bool has_scan)
{
    if (kind == JOB_OF_PROFILE) return stage->of_profile;
    return (!stage->of_scan || has_scan) && (!stage->of_model || kind != JOB_OF_GEOMETRY) &&
           (!stage->of_fit || kind == JOB_OF_FIT);
}
