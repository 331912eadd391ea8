/* The parts of result.json that depend on options of the fit (job_fit_option.h), and its certificate. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_OPTIONS_JSON_H
#define SELVEDGE_OPTIMIZER_RESULT_OPTIONS_JSON_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>

/* Adds "tied_to", "ratio" and "prior" to the entry of parameter p. */
void result_parameter_options(const struct pipeline_model *m, size_t p, json_t *parameter);
/* Adds "gain", "gain_se" and "texture" to row i. Gains are numbers when each photograph has its own, otherwise null;
 * texture is null without that option. */
void result_row_options(const struct report *report, const struct pipeline_model *m, size_t i, json_t *row);
/* Adds "prior_penalty", "nuisance", "starts", "next_photograph", "certificate", and "fit_rel_rms_with_gains" and
 * "heldout_rel_rms_with_gains", each with its "..._se". */
void result_fit_options(const struct report *report, const struct pipeline_model *m, json_t *result);
/* Writes the same parts to the summary for people. */
void result_summary_options(const struct report *report, const struct pipeline_model *m, FILE *out);

/* The discrepancy of the result (optimizer/fit/baseline): its share, the errors without it, and all numbers of the
 * factor, so that another program can apply it. null where the model has none. */
json_t *discrepancy_json(const struct pipeline_model *m);

#endif
