/* The order of the fits where a model contains another model of the job (MODEL_CONTAINS in base/catalogue/model_row.h).
 * The contained model is fitted first, and its result is a further start of the containing model, which therefore does
 * not end worse. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_NESTING_H
#define SELVEDGE_OPTIMIZER_PIPELINE_NESTING_H

#include "optimizer/stages/fit_stages.h"

/* Writes the order of the fits: the job's order, except that a contained model comes first. */
void pipeline_fit_order(const struct model_setup *model, size_t n_model, size_t order[JOB_MAX_MODEL]);
/* Number of starts that contained models add to the fit of model i_model. */
size_t pipeline_n_nested_start(const struct model_setup *model, size_t n_model, size_t i_model);
/* The models of a job with the fits that are done. */
struct nested_models {
    size_t n;
    const struct model_setup *setup;
    const struct model_fit *fit;
    size_t n_number; /* fitted numbers of the cloth */
};

/* Adds these starts to o: the results of the contained models, with the values of the catalogue for the parameter that
 * they do not have, and their numbers of the cloth behind the parameters. Those models have been fitted. */
void pipeline_add_nested_starts(const struct nested_models *m, size_t i_model, struct fit_option *o);

#endif
