/* Compresses a table of four axes to a sum of products of one function for each axis (canonical polyadic
 * decomposition), all at least 0:
 *
 *     x[i][j][k][l] = sum over r of f0[i][r] f1[j][r] f2[k][r] f3[l][r]
 *
 * by alternating least squares over one column at a time (Cichocki and Phan 2009, "Fast Local Algorithms for Large
 * Scale Nonnegative Matrix and Tensor Factorizations"). Yan, Jensen and Ramamoorthi 2017, section 4.3, allow negative
 * factors; without them every interpolation is a density.
 */
#ifndef SELVEDGE_RENDERER_MEDULLA_FIT_H
#define SELVEDGE_RENDERER_MEDULLA_FIT_H

#include "base/status.h"

#include <stdint.h>

enum { MEDULLA_FIT_MOST_RANK = 64 };

/* n: sizes of the axes; factor[a][i * rank + r] is filled in. Starts from random numbers of a seed. Returns in
 * *rel_error the norm of the residual over the norm of x (roots of sums of squares). STATUS_NO_MEMORY. */
status medulla_fit(const float *x, const int n[4], int rank, int n_sweep, uint64_t seed, double *factor[4],
                   double *rel_error, struct error *err);

#endif
