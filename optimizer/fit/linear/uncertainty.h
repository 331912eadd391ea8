/* How well the observations determine the parameters.
 *
 * The covariance in fit coordinates is a sandwich, over the parameters that are not fixed:
 *   cov = (H + L)^-1 (B + s2 L) (H + L)^-1,   H = J'J,  B = J' V J + D.
 * J' V J is a mirrored product of two independent replicas, so the noise of J does not make it larger. From J'J of the
 * mean of both, the noise that their difference shows is subtracted, which is the same in the mean, but in no direction
 * more than three quarters: where noise and information are alike, their difference is chance, and the errors with it.
 *   V    covariance of the residuals: the photographs' part, in which the error of the color matrix is the same for
 *        all of them (linear_model.h); the misfit's part (the part of f per degree of freedom that no noise explains);
 *        and the Monte-Carlo variance of the pooled mean, which is fully correlated between channels, because they
 *        share their paths, and correlated between configurations that share camera paths (linear_pair);
 *   D    Monte-Carlo noise of J times the residuals, with the correlations of V between configurations;
 *   s2   mean of V, without the error of the color matrix: an error in common says nothing about the prior's weight;
 *   L    s2 / (prior sd)^2, the allowed range as a weak prior, so that an undetermined parameter gets an error as
 *        large as its range instead of infinity. The model's own priors (linear_model.h) add their precision to it.
 *
 * A parameter at a bound counts like the others: noise may have driven it there, so it is not known as if it were
 * fixed. Where the truth is at the bound, the errors of the others are a little too large. Errors in file units follow
 * by the delta method, se(p) = |dp/dx| se(x), and are at most the error of a uniform distribution over the allowed
 * range, and at most the prior's. */
#ifndef SELVEDGE_OPTIMIZER_UNCERTAINTY_H
#define SELVEDGE_OPTIMIZER_UNCERTAINTY_H

#include "optimizer/fit/linear/linear_model.h"

#include <stdbool.h>

struct uncertainty {
    size_t n_param;
    double cov[FIT_MAX_PARAM * FIT_MAX_PARAM]; /* fit coordinates; rows of fixed parameters are zero */
    /* 1 on the diagonal, 0 where a parameter is fixed */
    double correlation[FIT_MAX_PARAM * FIT_MAX_PARAM];
    double se_param[FIT_MAX_PARAM]; /* internal unit; 0 for fixed parameters */
    bool at_bound[FIT_MAX_PARAM];
    bool determined[FIT_MAX_PARAM]; /* uncertainty_determined; true for fixed ones */
    /* per residual of a mean (contrasts of a texture have a misfit of their own), in units of the objective: about
     * the squared relative error that the model leaves */
    double misfit_var;
    /* mean Monte-Carlo variance per residual of the pooled mean; this and the next without extra weights */
    double noise_var;
    double photograph_var; /* mean variance per residual by the photographs' stated errors */
};

/* Returns whether the standard error is below half of the error of a uniform distribution over the allowed range of k,
 * in the parameter (se_param) and in its fit coordinate (sd), and for parameters that move in the logarithm below a
 * factor of 2. */
bool uncertainty_determined(const struct coordinate *k, double sd, double se_param);

/* Expected decrease of the weighted objective by a step that follows nothing but the noise of tracing,
 * tr((H + L)^-1 (B of tracing)). The noise of the parameters adds as much to the objective at the end of such a step.
 * The prior's unit is m->row_var. */
double uncertainty_noise_decrease(const struct linear_model *m, const struct coordinate *k, const bool *fixed);

/* m: pooled at the result. fixed: n_param flags. */
void uncertainty_compute(const struct linear_model *m, const struct coordinate *k, const bool *fixed,
                         struct uncertainty *u);

#endif
