/* Weight of a wavelength in each channel of linear sRGB, for reflectances under the illuminant D65. Equal reflectances
 * at all wavelengths give equal channels. */
#ifndef SELVEDGE_RENDERER_OBSERVER_WEIGHTS_H
#define SELVEDGE_RENDERER_OBSERVER_WEIGHTS_H

#include <stddef.h>

enum { OBSERVER_FIRST_NM = 380, OBSERVER_STEP_NM = 10, OBSERVER_N = 36 };

/* Weight at a wavelength in channel c (0: red, 1: green, 2: blue), linear between the rows of the table and 0 outside
 * of 380 to 730 nm: the matching functions of CIE's standard observer of 1931 times the illuminant D65 (CIE 015),
 * through the matrix of IEC 61966-2-1. The rows of each channel have the sum 1, so the integral over nm is 10. */
double observer_weight(double nm, size_t c);

#endif
