/* The 3 x 3 matrix from a camera's rgb to radiances, from patches of known radiance.
 *
 * Least squares over the patches under the condition that the white patch is matched exactly (fiber-scattering thesis,
 * B.2). For each row m of the matrix, with the patches' measured p and wanted r, and p_w, r_w for the white patch:
 *   m = A^-1 (b - mu p_w),  mu = (p_w' A^-1 b - r_w) / (p_w' A^-1 p_w),  A = sum p p',  b = sum p r. */
#ifndef SELVEDGE_OPTIMIZER_COLOR_MATRIX_H
#define SELVEDGE_OPTIMIZER_COLOR_MATRIX_H

#include "base/status.h"
#include "renderer/image/image.h"

/* n patches; i_white: which one is matched exactly. matrix: row-major, radiance = matrix rgb. STATUS_NUMERIC when the
 * patches do not determine a matrix (all of one color). */
status color_matrix_fit(size_t n, const double (*measured_rgb)[3], const double (*wanted_rgb)[3], size_t i_white,
                        double matrix[9], struct error *err);
/* Covariance of each row of the matrix that color_matrix_fit gave, for independent rows. var: of the measured means of
 * each patch and channel of the camera. A patch has in row m the variance v_i = sum m_k^2 var_ik. All patches but the
 * white one also have the variance of the row's residuals (of n - 3 degrees of freedom) that exceeds the mean of these:
 * no matrix turns all colors into the colors of the chart. Bright patches, which have the most noise, also weigh most.
 *   cov = P (sum v_i p_i p_i') P + v_w g g',  P = A^-1 - A^-1 p_w p_w' A^-1 / p_w' A^-1 p_w,
 *   g = A^-1 p_w / (p_w' A^-1 p_w).
 * Zero with fewer than 4 patches. */
void color_matrix_covariance(size_t n, const double (*measured_rgb)[3], const double (*wanted_rgb)[3], size_t i_white,
                             const double matrix[9], const double (*var)[3], double cov[3][9]);
/* The errors of a channel of camera rgb `in` that the covariance of its row makes, by three independent causes. */
void color_matrix_error(const double cov[9], const double in[3], double error[3]);
void color_matrix_apply(const double matrix[9], const double in[3], double out[3]);
void color_matrix_apply_image(const double matrix[9], struct image *im);

/* Color difference CIEDE2000 of two linear sRGB colors, where 1, 1, 1 is white (D65; Sharma, Wu, Dalal 2005). */
double color_delta_e_2000(const double a_rgb[3], const double b_rgb[3]);

#endif
