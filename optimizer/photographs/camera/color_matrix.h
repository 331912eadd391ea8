/* A 3 x 3 matrix of colors, and differences of colors. */
#ifndef SELVEDGE_OPTIMIZER_COLOR_MATRIX_H
#define SELVEDGE_OPTIMIZER_COLOR_MATRIX_H

#include "base/status.h"
#include "renderer/image/image.h"

void color_matrix_apply(const double matrix[9], const double in[3], double out[3]);
void color_matrix_apply_image(const double matrix[9], struct image *im);

/* Color difference CIEDE2000 of two linear sRGB colors, where 1, 1, 1 is white (D65; Sharma, Wu, Dalal 2005). */
double color_delta_e_2000(const double a_rgb[3], const double b_rgb[3]);

#endif
