/* Cross-validation inside the fitted rows: how well a fit predicts rows that it has not seen. Models of one job are
 * compared by it, so the held-out rows have no part in the choice.
 *
 * Folds: optimizer/fit/objective/folds.h. The fit without a fold is not repeated with new paths. The pooled linear
 * model at the result is minimised anew without the fold's rows: weights, priors and bounds come from the fit, the
 * allowed range of each parameter is a weak prior about the result (as in uncertainty.h), and no parameter moves by
 * more than a few step limits. The fold's residuals then follow from the same linear model. The two replicas have
 * independent noise, so the product of their predicted residuals is an unbiased square, as in objective.h.
 *
 * Errors are relative to the brightness of the row (objective.h, relative RMS error). Contrasts and rows of weight 0
 * are fitted like the others but not scored. With one gain for each photograph the residuals are without these gains
 * (linear_gain.h).
 *
 * With a discrepancy (discrepancy_fit.h) each fold has one of its own, by the predicted residuals of the rows left in.
 * It counts by a share in [0, 1], the same for all folds, which is the one with the lowest error; so the error is too
 * low by the gain of one fitted number.
 *
 * Source: Stone 1974, Cross-validatory choice and assessment of statistical predictions; the update of a linear model
 * without some of its rows is as in Hastie, Tibshirani, Friedman 2009, section 7.10. */
#ifndef SELVEDGE_OPTIMIZER_CROSS_VALIDATION_H
#define SELVEDGE_OPTIMIZER_CROSS_VALIDATION_H

#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/objective/folds.h"

#include <stdbool.h>

struct cross_validation {
    size_t n_fold;                 /* 0: there are too few rows, and all that follows is not set */
    size_t n_row;                  /* rows that were left out and predicted, each once */
    double rel_square;             /* mean square of the relative errors; may be below 0 by noise */
    double rel_rms;                /* sqrt(max(0, rel_square)) */
    double rel_rms_se;             /* by the scatter between folds, which contains the scatter of the model's misfit */
    double discrepancy_share;      /* 0 where no discrepancy was asked for */
    double plain_rel_rms;          /* the error with a share of 0 */
    double fold_square[FOLDS_MAX]; /* sum of the squares of a fold */
    double fold_count[FOLDS_MAX];  /* numbers (three for each row) in that sum */
};

/* m: pooled at the result, with the weights of the fit. o: its observations. k, fixed: n_param each. There are too few
 * rows when there are fewer than FOLDS_LEAST folds, or when the rows outside a fold have no more
 * numbers than there are free parameters. STATUS_NO_MEMORY, and the errors of bounded_quadratic. */
status cross_validation_compute(const struct linear_model *m, const struct observation_set *o,
                                const struct coordinate *k, const bool *fixed, bool discrepancy,
                                struct cross_validation *out, struct error *err);

/* Difference of rel_square, b minus a, of two fits to the same rows, and its standard error by the scatter of the
 * folds' differences. Both must have folds. */
double cross_validation_difference(const struct cross_validation *a, const struct cross_validation *b, double *se);

#endif
