/* The objective of the fit: weighted squared differences of mean radiances (fabric thesis 5.5.3, eqs. 5.11 and 5.12).
 *
 *   a_i = mean over channels of M_i,  tau = 0.02,  w_i = weight_i / max(a_i, tau)^2,
 *   f   = sum_i w_i sum_c (R_ic - M_ic)^2
 *
 * R is known through noisy estimates only, so the square is replaced by the product of two independent replicas A and
 * B: f = sum_i w_i sum_c (A_ic - M_ic)(B_ic - M_ic),       E f = f of the true means; single values may be negative,
 * and the gradient by the mirrored average  sum_i w_i sum_c [(A - M) dB + (B - M) dA].
 *
 * Standard error: Var[(A-M)(B-M)] = ra^2 vb + rb^2 va - va vb (unbiased, since E ra^2 = r^2 + va). The channels of one
 * configuration share their paths; their correlation is not in an estimate, so it is taken as full: the stated error is
 * an upper estimate, too large by at most a factor sqrt(3). Configurations that share camera paths (estimate.partner)
 * have covariances (product_noise.h).
 *
 * Relative RMS error of n rows: sqrt(max(0, sum_i sum_c (A-M)(B-M) / max(a_i, tau)^2) / (3 n)), extra weights left out.
 * Contrasts and rows of weight 0 do not count in it. The Monte-Carlo variance cancels in the product, so nothing is
 * subtracted and the figure does not fall when fewer paths are used. */
#ifndef SELVEDGE_OPTIMIZER_OBJECTIVE_H
#define SELVEDGE_OPTIMIZER_OBJECTIVE_H

#include "optimizer/photographs/rows/observation.h"
#include "renderer/estimate/estimate.h"

#define OBJECTIVE_TAU 0.02
/* Contrasts (observation_is_contrast): C is a squared coefficient of variation, so half its relative error is the
 * relative error of the scatter itself; w_i = weight_i / (2 max(a_i, tau_C))^2 with a_i the mean over channels of C,
 * and cloth that scatters by less than 2 % counts as if it did. */
#define OBJECTIVE_CONTRAST_TAU 4e-4

struct objective_value {
    double value, se;
    double rel_rms;
    /* Set by objective_evaluate only. rel_square: square of rel_rms before the root is taken, which has no bias and
     * is below 0 when there is nothing but noise; and standard errors. */
    double rel_square, rel_square_se, rel_rms_se;
};

/* Relative errors of the channels apart: each residual is divided by the measured radiance of its own channel,
 * sqrt(max(0, sum_i (A-M)(B-M) / max(M_ic, OBJECTIVE_CHANNEL_TAU)^2 / n)). The figure above divides by the mean of the
 * channels, so an error of 100 % in a dark channel of a coloured cloth may count as a few per cent there. */
#define OBJECTIVE_CHANNEL_TAU 0.002
struct objective_channels {
    double rel_rms[3], rel_rms_se[3]; /* NaN without rows */
};

/* 1 / max(a_i, tau)^2, without the observation's extra weight. */
double objective_relative_weight(const struct observation *o);
/* w_i */
double objective_weight(const struct observation *o);

/* w_i se_ic^2: variance of a residual by the photograph's stated error; and its mean over all rows. */
double objective_photograph_variance(const struct observation *o, size_t channel);
double objective_mean_photograph_variance(const struct observation_set *o);

/* a, b: one estimate per observation, from independent replicas. */
void objective_evaluate(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                        struct objective_value *out);
/* The same for the channels apart. Contrasts and rows of weight 0 are left out. */
void objective_evaluate_channels(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                                 struct objective_channels *out);
/* The relative error of one row, sqrt(max(0, sum_c (A-M)(B-M) / 3)) / max(a, tau), and its standard error: the mean
 * square of the rows' errors is the square of their relative RMS error above. */
double objective_row_error(const struct observation *o, const struct estimate *a, const struct estimate *b, double *se);
/* gradient[n_param], by internal units. */
void objective_gradient(const struct observation_set *o, const struct estimate *a, const struct estimate *b,
                        size_t n_param, double *gradient);
/* Sum over c of (x_c - y_c)^2 (eq. 5.12). */
double objective_image_difference(const double x_rgb[3], const double y_rgb[3]);

#endif
