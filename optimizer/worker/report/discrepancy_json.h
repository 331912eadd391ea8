/* The discrepancy of the result (optimizer/fit/discrepancy) as a part of result.json: its share, what the errors are
 * without it, and all numbers of the factor, so that another program can apply it. */
#ifndef SELVEDGE_OPTIMIZER_DISCREPANCY_JSON_H
#define SELVEDGE_OPTIMIZER_DISCREPANCY_JSON_H

#include "optimizer/worker/pipeline_context.h"

/* null where the model has none. */
json_t *discrepancy_json(const struct pipeline_model *m);

#endif
