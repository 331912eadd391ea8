/* Which photograph to take next: what one more photograph of a candidate configuration would do to the covariance of
 * the parameters, by the Monte-Carlo Jacobian of that configuration at the result (optimal experimental design; Kiefer
 * 1959 for the criterion).
 *
 * With C the covariance of the unknowns of the fit (fit_layout.h) in fit coordinates (its weak prior of the allowed range
 * included, so undetermined parameters count with their range), J the candidate's 3 x n derivatives in units of the
 * objective and V the covariance of its three residuals:
 *     information = 1/2 ln det(V + J C J') - 1/2 ln det(V + J_n C_n J_n')
 *     C_after     = C - C J' (J C J' + V)^-1 J C
 * with C_n what is left of the covariance of the nuisance terms (global gain, stray light) when the parameters are known:
 * the fall of 1/2 ln det of the parameters' covariance (D-optimality), in nats; without nuisance terms the second
 * determinant is that of V. J C J' is the symmetrised product of two independent replicas, so the noise of J does not
 * pass for information. V is the variance that the fit left on a residual of weight 1; sum_p C_pp times the variance of the
 * estimated J_p (the channels, which share their paths, fully correlated): what is known of J only through noise counts as noise,
 * so rough estimates make a candidate look worse, never better; and, where every photograph has a gain of its own,
 * photograph_gain_sd^2 m m' with m the candidate's relative radiances.
 * Parameters that are fixed do not count.
 */
#ifndef SELVEDGE_OPTIMIZER_NEXT_PHOTOGRAPH_H
#define SELVEDGE_OPTIMIZER_NEXT_PHOTOGRAPH_H

#include "optimizer/fit/objective/fit_layout.h"
#include "optimizer/fit/objective/uncertainty.h"

struct candidate_score {
    double information;                    /* nats; 0: nothing new */
    double se_after[SCATTERING_MAX_PARAM]; /* expected, internal units, every parameter of the model */
    bool determines[SCATTERING_MAX_PARAM]; /* not determined now, determined with this photograph */
};

/* A fit as fit_run makes it. */
struct next_photograph_fit {
    const struct fit_layout *layout;
    const double *unknown;                 /* layout->n_unknown values: fit_result.unknown */
    const struct uncertainty *uncertainty; /* of these: fit_result.unknown_uncertainty */
    double photograph_gain_sd;             /* as in fit_option */
};

/* a, b: estimates of the candidate with derivatives at the result, by the model's parameters. */
void next_photograph_score(const struct next_photograph_fit *f, const struct estimate *a, const struct estimate *b,
                           struct candidate_score *score);

#endif
