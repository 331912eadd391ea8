/* Tells scans that show nothing but noise from scans with anything in them.
 *
 * A scanner's noise is nearly Gaussian once it is averaged, so its response to any linear filter is Gaussian, however
 * its voxels are correlated. Material has an outline and is denser than void, so it makes the response of the Laplacian
 * of a Gaussian skew or heavy-tailed at some scale. For Gaussian noise the skewness and the excess kurtosis of N
 * correlated values have the variances 6 sum rho^3 / N and 24 sum rho^4 / N, with sums of the autocorrelation rho over
 * all offsets. For the Laplacian of noise that is blurred by s voxels these sums are 2.00 s^3 and 1.39 s^3. s^2 is 7/2
 * of the variance of the response over the mean square of its gradient. */
#ifndef SELVEDGE_GEOMETRY_SCAN_STRUCTURE_H
#define SELVEDGE_GEOMETRY_SCAN_STRUCTURE_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Deviations from the moments of Gaussian noise, over their standard errors, that are more than chance: noise alone has
 * up to 3 in all bricks and scales of a scan. */
#define SCAN_STRUCTURE_LEAST 4.0

/* *deviation: largest deviation of skewness and kurtosis from noise over its standard error, in any brick of 64^3
 * voxels and in all bricks together, at scales from 1 to 5.7 voxels. The densest bricks come first, and none is looked
 * at once the deviation exceeds SCAN_STRUCTURE_LEAST; of more than 128 bricks that many are taken. v: densities that
 * are not clamped. Bricks with voxels at VOLUME_OUTSIDE say nothing. INFINITY if there is no other brick, or if v is
 * thinner than 16 voxels. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status scan_structure_measure(const struct volume *v, struct thread_pool *pool, double *deviation, struct error *err);

#endif
