/* The checks, before a fit, whether its method can keep to the job's path budget and to its goal of precision. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_BUDGET_H
#define SELVEDGE_OPTIMIZER_PIPELINE_BUDGET_H

#include "optimizer/stages/job_inputs.h"

/* Warns of each model whose fit takes more paths than the document states, and names the least that it takes. After
 * models and rows are known. Warns, too, of a goal of precision where the rows state no errors. */
status pipeline_warn_budget(const struct stage_tools *tools, const struct job_inputs *in, struct error *err);

#endif
