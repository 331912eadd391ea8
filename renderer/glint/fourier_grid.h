/* Discrete Fourier transform of a square periodic grid of complex numbers, for maps of noise. */
#ifndef SELVEDGE_RENDERER_FOURIER_GRID_H
#define SELVEDGE_RENDERER_FOURIER_GRID_H

#include "base/status.h"

/* Transforms value (n x n complex numbers, re and im side by side, row-major) in place:
 * sum over (x, y) of value exp(sign 2 pi i (x kx + y ky) / n), sign +1 or -1, without a factor. n must be a power of
 * two. STATUS_NO_MEMORY. */
status fourier_grid_transform(double (*value)[2], size_t n, int sign, struct error *err);

#endif
