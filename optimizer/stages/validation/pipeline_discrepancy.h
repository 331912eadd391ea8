/* The discrepancy of a fitted cloth (optimizer/fit/baseline): found from the fitted rows' fresh estimates, and
 * applied to the estimates of all rows. Pictures and tables of the cloth are rendered with it. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_DISCREPANCY_H
#define SELVEDGE_OPTIMIZER_PIPELINE_DISCREPANCY_H

#include "optimizer/stages/fit_stages.h"

/* For radiance_input: NULL where there is none, or v is NULL. */
const struct discrepancy *pipeline_discrepancy(const struct validation *v);
/* Returns whether a fitted model will have one (pipeline_find_discrepancy). */
bool pipeline_discrepancy_expected(const struct job_fit *fit, const struct pipeline_model *m);
/* Finds the factor of a model whose rows have been estimated and scored, and multiplies these estimates by it. There
 * is none where the job does not ask for one, where it does not lower the error of rows that are left out, and for
 * volumes. The last two give a warning. STATUS_NO_MEMORY. */
status pipeline_find_discrepancy(const struct cloth_job *job, const struct pipeline_model *m, struct validation *v,
                                 struct error *err);

#endif
