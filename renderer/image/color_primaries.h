/* Conversion of linear rgb of other primaries to linear rgb of Rec. 709, which are the primaries of sRGB, white D65. */
#ifndef SELVEDGE_RENDERER_COLOR_PRIMARIES_H
#define SELVEDGE_RENDERER_COLOR_PRIMARIES_H

#include "renderer/image/image.h"

#include <stdbool.h>

/* CIE xy of red, green, blue and the white point. */
struct color_primaries {
    double xy[4][2];
};

/* The row-major matrix from these primaries to Rec. 709, white on white: with Bradford's adaptation, as ICC profiles
 * and littleCMS have it. The primaries (1, 0), (0, 1), (0, 0) stand for tristimulus values X, Y, Z themselves, without
 * the scale that would make the white point (1, 1, 1). Returns false for primaries that span no space of colors. */
bool color_primaries_matrix(const struct color_primaries *p, double matrix[9]);
/* The matrix from columns that are tristimulus values of red, green and blue adapted to D50, as profiles state them. */
bool color_columns_matrix(const double column_xyz_d50[9], double matrix[9]);
/* Returns whether the matrix changes no color by more than 0.0005 of full scale. */
bool color_matrix_is_identity(const double matrix[9]);
/* Multiplies the first three channels of every pixel. */
void image_apply_matrix(struct image *im, const double matrix[9]);

#endif
