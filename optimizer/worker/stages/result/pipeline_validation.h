/* The stage "validation" as others see it. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_VALIDATION_H
#define SELVEDGE_OPTIMIZER_PIPELINE_VALIDATION_H

#include "optimizer/worker/pipeline_context.h"

/* Paths that the validation of all models may take, after the fit. It takes fewer where rendered means become precise
 * enough with less. */
double pipeline_validation_paths(const struct pipeline_context *c);

#endif
