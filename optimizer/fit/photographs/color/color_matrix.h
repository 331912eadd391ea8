/* The 3 x 3 matrix from a camera's rgb to radiances, from patches of known radiance.
 *
 * Least squares over the patches under the condition that the white patch is matched exactly (fiber-scattering thesis,
 * B.2). For each row m of the matrix, with the patches' measured p and wanted r, and p_w, r_w those of the white one:
 *   m = A^-1 (b - mu p_w),  mu = (p_w' A^-1 b - r_w) / (p_w' A^-1 p_w),  A = sum p p',  b = sum p r.
 */
#ifndef SELVEDGE_OPTIMIZER_COLOR_MATRIX_H
#define SELVEDGE_OPTIMIZER_COLOR_MATRIX_H

#include "base/status.h"
#include "renderer/image/image.h"

/* n patches; i_white: which one is matched exactly. matrix: row-major, radiance = matrix rgb. STATUS_NUMERIC when the
 * patches do not determine a matrix (all of one color). */
status color_matrix_fit(size_t n, const double (*measured_rgb)[3], const double (*wanted_rgb)[3], size_t i_white,
                        double matrix[9], struct error *err);
void color_matrix_apply(const double matrix[9], const double in[3], double out[3]);
void color_matrix_apply_image(const double matrix[9], struct image *im);

/* Color difference CIEDE2000 of two linear sRGB colors, where 1, 1, 1 is white (D65; Sharma, Wu, Dalal 2005). */
double color_delta_e_2000(const double a_rgb[3], const double b_rgb[3]);

#endif
