/* Which photograph to take next: how much one more photograph of a candidate configuration would reduce the covariance
 * of the parameters, by the candidate's Monte-Carlo Jacobian at the result (optimal experimental design; Kiefer 1959
 * for the criterion).
 *
 * C is the covariance of the unknowns of the fit (fit_layout.h) in fit coordinates. It contains the weak prior of the
 * allowed range, so undetermined parameters count with their range. J are the candidate's 3 x n derivatives in units of
 * the objective, V is the covariance of its three residuals, and C_n the covariance of the nuisance terms (global gain,
 * stray light) when the parameters are known:
 *     information = 1/2 ln det(V + J C J') - 1/2 ln det(V + J_n C_n J_n')
 *     C_after     = C - C J' (J C J' + V)^-1 J C
 * The information is the decrease of 1/2 ln det of the parameters' covariance (D-optimality), in nats. Without nuisance
 * terms the second determinant is det V. J C J' is the symmetrised product of two independent replicas, so the noise of
 * J does not count as information.
 *
 * With a prediction of the misfit its smooth part (variance k, common to the channels, as far as the fitted rows do not
 * tell it) is an unknown like the parameters. V then contains k 1 1', which hides parameters, and the information about
 * the misfit, 1/2 ln(1 + 3 k / v) with v the rest of a residual's variance, is added: photographs count that show where
 * the model fails, too.
 *
 * V is the sum of the variance that the fit left on a residual of weight 1; of sum_p C_pp times the variance of the
 * estimated J_p, with the channels, which share their paths, fully correlated; and, where every photograph has a gain
 * of its own, of photograph_gain_sd^2 m m' with the candidate's relative radiances m. The second term counts the noise
 * of J as noise of the photograph, so rough estimates make a candidate look worse, never better. Fixed parameters do
 * not count. */
#ifndef SELVEDGE_OPTIMIZER_NEXT_PHOTOGRAPH_H
#define SELVEDGE_OPTIMIZER_NEXT_PHOTOGRAPH_H

#include "optimizer/fit/linear/fit_layout.h"
#include "optimizer/fit/linear/uncertainty.h"
#include "optimizer/fit/objective/misfit_field.h"

struct candidate_score {
    double information;             /* nats; 0 when the photograph adds nothing */
    double misfit_information;      /* the part of it that is about the misfit, not about the parameters */
    double se_after[FIT_MAX_PARAM]; /* expected, internal units, every parameter of the model */
    bool determines[FIT_MAX_PARAM]; /* not determined now, determined with this photograph */
};

/* The result of fit_run that candidates are scored for. */
struct next_photograph_fit {
    const struct fit_layout *layout;
    const double *unknown;                 /* layout->n_unknown values: fit_result.unknown */
    const struct uncertainty *uncertainty; /* of the unknowns: fit_result.unknown_uncertainty */
    double photograph_gain_sd;             /* as in fit_option */
    /* of the misfit at the candidate (misfit_field.h); NULL: all of uncertainty->misfit_var is independent */
    const struct misfit_prediction *misfit;
};

/* a, b: two independent estimates of the candidate at the result, with derivatives by the model's parameters. */
void next_photograph_score(const struct next_photograph_fit *f, const struct estimate *a, const struct estimate *b,
                           struct candidate_score *score);

#endif
