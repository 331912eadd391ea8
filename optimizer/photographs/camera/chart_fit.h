/* The matrix from a camera's rgb to radiances, and the fall of the lamp's light over the chart, fitted together.
 *
 *   M p_i = (1 + a' phi(x_i)) r_i,   phi = x, y, x^2, x y, y^2, less their values at the place of the scale,
 *
 * for patches of camera rgb p, radiance r under an even lamp, and place x. This is linear in M and a. Patches weigh by
 * (mean r + 0.05 white)^-2, because errors of a chart's colors are relative to their light. A prior of 15 % for the
 * linear and of 6 % for the quadratic terms, from the middle to the edge, decides where the patches do not.
 *
 * Covariance: H^-1 (sum w^2 X' V X) H^-1. V of a patch is the mean of two estimates, because own residuals follow
 * saturated colors and pooled ones are steadier: its own residuals as if it were left out of the fit (HC3), and its
 * noise through M plus the covariance of all patches' residuals beyond noise.
 *
 * Differs from the fiber-scattering thesis, B.2, which matches the white patch exactly under an even lamp: the scale
 * then has the error of one patch in a corner. With reference errors of 1 % (simulated, 150 charts each) a grey card
 * was wrong by 1.2 % with it, and is by 0.5 % now; with a lamp that falls by 20 % by 9.6 % and 0.5 %. */
#ifndef SELVEDGE_OPTIMIZER_CHART_FIT_H
#define SELVEDGE_OPTIMIZER_CHART_FIT_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { CHART_FALL_TERMS = 5, CHART_FIT_MAX_PATCHES = 64, COLOR_MATRIX_CAUSES = 9 };

struct chart_patches {
    size_t n;
    const double (*measured)[3], (*wanted)[3], (*var)[3]; /* var: of the measured means */
    const double (*place)[2];                             /* x, y: the chart's length from -1 to 1 */
    double scale_at[2];                                   /* place at which the light counts as 1 */
    double white;                                         /* radiance of a perfect white */
};

struct chart_fit {
    double matrix[9]; /* row-major, radiance = matrix rgb */
    double fall[CHART_FALL_TERMS];
    double scale_at[2];
    double cov[81]; /* of the matrix */
};

/* STATUS_NUMERIC when the patches do not determine a matrix (fewer than 8, or all of one color). */
status chart_fit_patches(const struct chart_patches *p, struct chart_fit *fit, struct error *err);
/* Light at a place over the light at the place of the scale. */
double chart_fit_light(const struct chart_fit *fit, const double place[2]);
/* The best single factor for all channels under the fitted fall. */
double chart_fit_factor(const struct chart_patches *p, const struct chart_fit *fit);
/* Radiance of patch i by a fit to the other patches. False when they do not determine one. */
bool chart_fit_left_out(const struct chart_patches *p, size_t i, double rgb[3]);

/* Errors of each channel of camera rgb `in` by the independent causes of a matrix of this covariance. */
void color_matrix_error(const double cov[81], const double in[3], double error[3][COLOR_MATRIX_CAUSES]);

#endif
