/* Parameter rescaling of the published optimizer (fabric thesis 5.5.5, eq. 5.14, and B.1).
 *
 * For parameter p with the others at their start, R is evaluated at nine values c_1 .. c_9, and
 *   r_p(c_1) = 0,  r_p(c_{j+1}) - r_p(c_j) = sum_i w_i sqrt(f_image(R_i(c_j), R_i(c_{j+1}))),  piecewise linear
 * between; a colour parameter is moved in all three channels at once, and each channel gets r_p / 3. Descent runs in
 * r.
 *
 * Differs: the nine values of one curve are rendered with the same random numbers, which keeps noise out of their
 * differences; values below the bound of the fit (beta_TT: the published curve starts at 1 degree, the bound is 10)
 * are cut off, which shifts r by a constant only; channels with bounds of their own get a curve each, a third of the
 * colour's too. Parameters that the published table does not list get nine values evenly spaced in their fit
 * coordinate.
 */
#ifndef SELVEDGE_OPTIMIZER_RESCALE_H
#define SELVEDGE_OPTIMIZER_RESCALE_H

#include "optimizer/fit/descent/descent.h"

enum { RESCALE_POINTS = 9 };

/* Increasing; internal units. */
struct rescale_curve {
    size_t n;
    double c[RESCALE_POINTS], r[RESCALE_POINTS];
};

/* The published values c_1..c_9 in file units; false when the thesis lists none for this symbol. */
bool rescale_published_points(const char *symbol, double c[RESCALE_POINTS]);
/* Writes the points c of a curve between the bounds, in internal units; their number is 2 or more. */
void rescale_points(const struct param_info *info, const struct coordinate *k, struct rescale_curve *curve);
/* r of a parameter value and back, both clamped to the ends of the curve, and dp/dr of the piece that contains p. */
double rescale_forward(const struct rescale_curve *curve, double p);
double rescale_backward(const struct rescale_curve *curve, double r);
double rescale_slope(const struct rescale_curve *curve, double p);

/* Number of curves that rescale_measure renders, each with up to RESCALE_POINTS points. */
size_t rescale_n_curve(const struct fit_problem *problem, const struct coordinate *k);
/* Measures curve[n_param]; channels of one colour with the same bounds share the values. n_path: paths per
 * configuration of each rendering. Adds to *n_path_used and *wall_s. problem->path_budget is the budget of the whole
 * fit, whose progress is reported. STATUS_NO_MEMORY, and the estimator's errors. */
status rescale_measure(const struct fit_problem *problem, const struct coordinate *k, const size_t *n_path,
                       struct rescale_curve *curve, uint64_t *n_path_used, double *wall_s, struct error *err);

#endif
