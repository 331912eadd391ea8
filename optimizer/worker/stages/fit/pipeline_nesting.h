/* Starts of the fit of a model that contains another model of the job (MODEL_CONTAINS in base/catalogue/models.def). */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_NESTING_H
#define SELVEDGE_OPTIMIZER_PIPELINE_NESTING_H

#include "optimizer/worker/pipeline_context.h"

/* Number of starts that the models listed before model i_model add to its fit. A fit of numbers of the cloth has none:
 * the results belong to other cloths. */
size_t pipeline_n_nested_start(const struct pipeline_context *c, size_t i_model);
/* Adds these starts to o: the results of the contained models, with the values of the catalogue for the parameter that
 * they do not have. Those models have been fitted. */
void pipeline_add_nested_starts(const struct pipeline_context *c, size_t i_model, struct fit_option *o);

#endif
