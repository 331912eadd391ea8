/* Linear sRGB of values that were measured at several wavelengths, under the illuminant D65. Equal values at all
 * wavelengths give that value in all three channels. */
#ifndef SELVEDGE_OPTIMIZER_BRDF_SPECTRUM_H
#define SELVEDGE_OPTIMIZER_BRDF_SPECTRUM_H

#include <stdbool.h>
#include <stddef.h>

/* Weights of n rising wavelengths; rgb of values v is the sum of weight_rgb[i] v[i]. False when fewer than eight
 * of them lie in 400..700 nm, or when they leave a gap of more than 50 nm there: a color does not follow from
 * them. */
bool brdf_spectrum_weights(const double *wavelength_nm, size_t n, double (*weight_rgb)[3]);
/* Linear sRGB of CIE XYZ, relative to the white of D65 with Y = 1. */
void brdf_rgb_of_xyz(const double xyz[3], double rgb[3]);

#endif
