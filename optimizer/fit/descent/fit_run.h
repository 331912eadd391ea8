/* A whole fit as a job asks for it: ties, priors and nuisance terms around a method of descent, from one start or
 * several. The method sees a smaller problem (fit_layout.h); everything that comes out is in the model's parameters.
 *
 * Several starts: the first is the problem's own; the others are spread evenly (additive recurrence by the generalised
 * golden ratio) over the inner 80 % of the bounds in fit coordinates, or over two standard deviations of a prior. Extra
 * starts of the option come after the problem's own and before the others. Each takes its share of the path budget when
 * one is given, and the method's default otherwise. A later start is kept instead of an earlier one when its objective
 * (with its prior penalty) is lower by more than two standard errors of the difference. An extra start is the result of
 * another fit. It is kept if its objective is lower by any amount, so that this fit does not end worse than the other
 * one.
 *
 * A fit is deterministic, as its method is: it asks for the same estimates in the same order. With a journal as
 * estimator (estimate_journal.h), a fit with any option resumes bit by bit. */
#ifndef SELVEDGE_OPTIMIZER_FIT_RUN_H
#define SELVEDGE_OPTIMIZER_FIT_RUN_H

#include "optimizer/fit/descent/descent.h"

/* problem: in the model's parameters; its prior and gain_sd are ignored. option: NULL for none. Errors: from
 * fit_layout_init and from the method. */
status fit_run(const struct descent_method *method, const struct fit_problem *problem, const struct fit_option *option,
               struct fit_result *result, struct error *err);

/* Writes the values of the unknowns at start k >= 1 of a layout. */
void fit_run_start(const struct fit_layout *l, size_t k, double *unknown);

#endif
