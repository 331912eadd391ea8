/* Parts of result.json that exist because of options of the fit (job_fit_option.h), and its certificate. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_OPTIONS_JSON_H
#define SELVEDGE_OPTIMIZER_RESULT_OPTIONS_JSON_H

#include "optimizer/worker/pipeline_context.h"

#include <jansson.h>

/* Adds "tied_to", "ratio" and "prior" to the entry of parameter p. */
void result_parameter_options(const struct pipeline_model *m, size_t p, json_t *parameter);
/* Adds "gain" and "gain_se" to row i: numbers with a gain for each photograph, null otherwise; and "texture": null
 * unless asked for. */
void result_row_options(const struct pipeline_context *c, const struct pipeline_model *m, size_t i, json_t *row);
/* Adds "prior_penalty", "nuisance", "starts", "fit_rel_rms_with_gains", "heldout_rel_rms_with_gains" (each with "..._se"), "next_photograph" and "certificate" to the result. */
void result_fit_options(const struct pipeline_context *c, const struct pipeline_model *m, json_t *result);
/* The same for people. */
void result_summary_options(const struct pipeline_context *c, const struct pipeline_model *m, FILE *out);

#endif
