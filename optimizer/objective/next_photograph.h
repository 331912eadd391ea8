/* Which photograph to take next: what one more photograph of a candidate configuration would do to the covariance of
 * the parameters, by the Monte-Carlo Jacobian of that configuration at the result (optimal experimental design; Kiefer
 * 1959 for the criterion).
 *
 * With C the covariance of the fit in fit coordinates (its weak prior of the allowed range included, so undetermined
 * parameters count with their range), J the candidate's 3 x n derivatives in units of the objective and V the covariance
 * of its three residuals:
 *     information = 1/2 ln det(1 + V^-1 J C J')         (D-optimality: the fall of 1/2 ln det C, in nats)
 *     C_after     = C - C J' (J C J' + V)^-1 J C
 * J C J' is the symmetrised product of two independent replicas, so the noise of J does not pass for information. V is
 * the variance that the fit left on a residual, and sum_p C_pp times the variance of the estimated J_p (the channels,
 * which share their paths, fully correlated): what is known of J only through noise counts as noise, so rough
 * estimates make a candidate look worse, never better.
 * Parameters that are fixed do not count; one at a bound counts on its own, without its correlations.
 */
#ifndef SELVEDGE_OPTIMIZER_NEXT_PHOTOGRAPH_H
#define SELVEDGE_OPTIMIZER_NEXT_PHOTOGRAPH_H

#include "optimizer/objective/fit_layout.h"
#include "optimizer/objective/uncertainty.h"

struct candidate_score {
    double information;                    /* nats; 0: nothing new */
    double se_after[SCATTERING_MAX_PARAM]; /* expected, internal units, every parameter of the model */
    bool determines[SCATTERING_MAX_PARAM]; /* not determined now, determined with this photograph */
};

/* info, parameter, param, u: of the model and its fit (n_param of each). leader, ratio: of tied parameters, as in
 * fit_option. a, b: estimates of the candidate with derivatives at param. */
void next_photograph_score(const struct param_info *info, const struct fit_parameter *parameter, const double *param,
                           const struct uncertainty *u, const size_t *leader, const double *ratio,
                           const struct estimate *a, const struct estimate *b, struct candidate_score *score);

#endif
