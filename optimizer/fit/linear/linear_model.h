/* The linear model of the residuals near one point, pooled from all estimates of a fit so far: R(x) ~ R + J (x -
 * x_ref), for two independent replicas.
 *
 * Every estimate of every iteration is kept (linear_history). To pool them at a reference point, each estimate is
 * carried there by derivatives at half the way, which is exact to second order. These derivatives are averages over all
 * steps, with the largest weights near the middle. The carried estimates are averaged with weights 1 / (noise^2 +
 * bend^2). The noise follows from the number of paths and the configuration's pooled variance per path, not from the
 * estimate's own variance, which is correlated with its value; and from the noise of the derivatives on the way, which
 * r_var contains too. The bend follows from the cube of the predicted change of the residuals between the two points,
 * and from the changes by single parameters: along a valley these changes cancel, but their bends do not. So early,
 * cheap iterations fade out and the last ones add up, which is the averaging over the last steps.
 *
 * Residuals are in units of the objective: r = sqrt(w_i) (R_ic - M_ic) in row 3 i + c. Columns are the fit coordinates
 * of all parameters. Ownership: init/release. Not thread-safe. */
#ifndef SELVEDGE_OPTIMIZER_LINEAR_MODEL_H
#define SELVEDGE_OPTIMIZER_LINEAR_MODEL_H

#include "optimizer/fit/objective/coordinate.h"
#include "optimizer/photographs/rows/observation.h"
#include "renderer/estimate/estimate.h"

_Static_assert((int)FIT_MAX_PARAM <= (int)SCATTERING_MAX_FLAT, "an estimate has room for the derivatives of a fit");

/* Prior of one unknown in its fit coordinate. precision: 1 / sd^2, 0 for no prior. */
struct gaussian_prior {
    double mean, precision;
};

struct history_step {
    double x[FIT_MAX_PARAM];
    double slope[FIT_MAX_PARAM]; /* d param / d x there */
    struct estimate *replica[2]; /* one per observation, owned */
};

struct linear_history {
    const struct observation_set *observation;
    const struct coordinate *coordinate; /* n_param */
    size_t n_param;
    size_t n_step, capacity;
    struct history_step *step;
};

/* Configurations i and j < i that share their camera paths: the noise of row 3 i + c has this correlation with the
 * noise of row 3 j + d. Channels count as fully correlated, as within a configuration. */
struct linear_pair {
    size_t i, j;
    double correlation;
};

/* Causes of errors that all photographs have in common: of the color matrix, and of the rounding of exposures. */
enum { LINEAR_COLOR_CAUSES = PHOTOGRAPH_CAUSES };

struct linear_model {
    size_t n_row, n_param;
    double x_ref[FIT_MAX_PARAM];
    double *r[2], *r_var[2]; /* n_row */
    double *j[2], *j_var[2]; /* n_row x n_param */
    /* n_row: variance of a residual by the photograph's stated error, set by linear_model_pool */
    double *photograph_var;
    /* n_row x LINEAR_COLOR_CAUSES: errors of a residual by one standard deviation of each cause of an
     * error that all rows have in common; color_var (n_row): the part of photograph_var that they make */
    double *color, *color_var;
    /* n_row: the observation's extra weight, which is in r, j and all variances; set by linear_model_pool */
    double *extra;
    double *contrast; /* n_row: 1 for a row of a contrast (texture), 0 for one of a mean; set by linear_model_pool */
    double *expected; /* n_row: 1 for a row that was not measured (observation.h); set by linear_model_pool */
    double *weight;   /* n_row: factor of a row in gradient and Hessian; 1 unless linear_model_weigh was called */
    double row_var;   /* variance of a residual by misfit and noise, set by linear_model_weigh: the prior's unit */
    const struct gaussian_prior *prior; /* n_param, NULL: none; the caller's */
    double gain_sd; /* of ln gain of each configuration, taken out of the residuals by linear_model_pool; 0: none */
    /* number of paths per configuration and replica that the averages are equivalent to, mean over configurations */
    double n_effective;
    struct linear_pair *pair; /* set by linear_model_pool */
    size_t n_pair;
};

void linear_history_init(struct linear_history *h, const struct observation_set *o, const struct coordinate *k,
                         size_t n_param);
void linear_history_release(struct linear_history *h);
/* Copies the estimates. */
status linear_history_append(struct linear_history *h, const double *x, const struct estimate *a,
                             const struct estimate *b, struct error *err);
/* Variance of one path of configuration i in squared relative units: w_i * (mean over channels and steps of var *
 * n_path). */
double linear_history_path_variance(const struct linear_history *h, size_t i);

status linear_model_init(struct linear_model *m, size_t n_row, size_t n_param, struct error *err);
void linear_model_release(struct linear_model *m);
/* Averages the history at x_ref. At least one step. STATUS_NO_MEMORY.
 *
 * With gain_sd > 0 each configuration's gain is marginalised (a photograph's exposure is known to gain_sd only): its
 * residuals have the covariance v I + gain_sd^2 m m', m = sqrt(w) M, and all rows are multiplied by
 * sqrt(v) (v I + gain_sd^2 m m')^(-1/2), after which they are independent with variance v again. v is the row's
 * Monte-Carlo variance plus the misfit that is left, found by iterating. */
status linear_model_pool(struct linear_model *m, const struct linear_history *h, const double *x_ref,
                         struct error *err);

/* Monte-Carlo variance of (r_A + r_B) / 2 of one row. */
double linear_model_row_noise(const struct linear_model *m, size_t row);
/* Variance of a residual (of extra weight 1) that neither tracing nor the photographs' stated errors explain, per
 * degree of freedom with n_free fitted parameters; 0 or more. The error of the color matrix explains none of it,
 * because the parameters follow an error that all rows have in common. Rows are averaged with weights 1 / (all of their
 * variance)^2, found by iterating: rows known to 0.5 % say more about a misfit of 1 % than those known to 5 %. Rows
 * of weight 0 and expected rows are left out. */
double linear_model_misfit(const struct linear_model *m, size_t n_free);
/* The same for the errors of the result: with weights 1 / (all of their variance), by which it does not hang on the few
 * rows that are known best (Paule and Mandel 1982). For the rows of means ([0]) and of contrasts ([1], 0 without any)
 * apart, because a model that is right in brightness to 1 % may be off by half in texture. */
void linear_model_misfits(const struct linear_model *m, size_t n_free, double misfit[2]);
/* Row weights v0 / (v_misfit + v_photograph + v_row): misfit, stated error and Monte-Carlo variance, all without extra
 * weights, which act as they are. While noise rules, rows that are known well count more (bright channels have the
 * longest paths and the most noise); where the model does not fit, or photographs state no errors and paths add up, all
 * weights go to 1 and the minimum is the minimum of f. Weights are kept until the next call and by
 * linear_model_pool. */
void linear_model_weigh(struct linear_model *m, size_t n_free);

/* s2 sum ((x - mean) / sd)^2 with s2 = row_var: the priors' part of f at x. */
double linear_model_penalty(const struct linear_model *m, const double *x);
/* f = r_A . r_B at x_ref, with its standard error (channels taken as fully correlated). */
double linear_model_objective(const struct linear_model *m, double *se);
/* The part of configuration i in f, with its standard error. */
double linear_model_part(const struct linear_model *m, size_t i, double *se);
/* 2 x mirrored average of J' r: the gradient of f by coordinates; priors included, here and in the Hessian. */
void linear_model_gradient(const struct linear_model *m, double *g);
/* Hessian of Gauss-Newton, 2 J'J. `cross`: symmetrised J_A' J_B, unbiased, may be indefinite; otherwise of the averaged
 * J, positive semi-definite and too large by the noise of J, which acts as a damping that fades as paths add up. */
void linear_model_hessian(const struct linear_model *m, bool cross, double *hessian);
/* The objective with the row weights of the fit, to which gradient and Hessian belong. */
double linear_model_weighted_objective(const struct linear_model *m);
/* Mean over rows of the variance of (r_A + r_B) / 2: with the row weights of the fit, and with equal weights as in f.
 */
double linear_model_noise(const struct linear_model *m);
double linear_model_mean_noise(const struct linear_model *m);

#endif
