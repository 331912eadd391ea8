/* The end of a method that does not pool its iterations: objective, errors and cross-validation from a few estimates at
 * the final parameters alone. */
#ifndef SELVEDGE_OPTIMIZER_DESCENT_END_H
#define SELVEDGE_OPTIMIZER_DESCENT_END_H

#include "optimizer/fit/descent/rest_check.h"

enum { DESCENT_N_END = 4 }; /* estimates of two replicas each, with derivatives */

/* Makes DESCENT_N_END estimates at param (internal units) with the paths of run->n_path and the random keys first_key,
 * first_key + 1, ..., reports each as a step "final", and fills in result except converged, stop and reason, which the
 * method decides; *end says whether a lower objective is near. Errors are those of the estimator, of the report
 * function, and STATUS_NO_MEMORY. */
status descent_end(struct descent_run *run, const double *param, uint32_t first_key, struct fit_result *result,
                   struct rest_check *end, struct error *err);

#endif
