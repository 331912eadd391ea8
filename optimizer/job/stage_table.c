#include "optimizer/job/stage_table.h"

/* A weight is the share of the wall time in a typical job: one small volume, 16 configurations, default budget, 2
 * cores. */
static const struct pipeline_stage_info stage_table[] = {
    {"volume", "Reading the scan", 0.01},
    {"orientation", "Finding local fiber directions", 0.04},
    {"fibers", "Tracing fibers", 0.13},
    {"directions", "Transferring fiber directions to the volume", 0.01},
    {"scene", "Building the scene", 0.01},
    {"fit", "Fitting the scattering parameters", 0.50},
    {"validation", "Rendering the fitted cloth for every photograph's configuration", 0.15},
    {"report", "Writing pictures and results", 0.15},
};

const struct pipeline_stage_info *pipeline_stage_table(size_t *n_stage)
{
    *n_stage = sizeof stage_table / sizeof stage_table[0];
    return stage_table;
}
