/* How strongly the noise of a scan responds at each scale (scale_space.h), measured in the void of this very scan. A
 * scanner's filter correlates the noise of neighbouring voxels, which makes its response at coarse scales stronger than
 * the response of white noise by any factor; so nothing is assumed about it. */
#ifndef SELVEDGE_GEOMETRY_SCALE_NOISE_H
#define SELVEDGE_GEOMETRY_SCALE_NOISE_H

#include "geometry/diameter/scale_space.h"

#include <stdbool.h>
#include <stdint.h>

/* Sums over the void of one or several bricks. */
struct scale_noise {
    double square[N_SCALE], n[N_SCALE];
    double n_void, n_clamped; /* voxels of void, and their number with density 0 */
};

/* Fills far with the distance of each voxel from material (density blurred by 1.4 voxels above 0.4) and from places
 * without noise, such as the outside of a round field of view, as steps to one of the 26 neighbours; UINT8_MAX from 8
 * steps on. a, b: scratch. */
void scale_find_void(const float *density, float *a, float *b, uint8_t *far, const size_t n[3]);

/* Adds the void of a brick of n voxels, at most SCALE_EDGE along each axis. a, b, far: scratch of one value per voxel.
 * At a scale only voxels count whose filter reaches no material. */
void scale_noise_add(struct scale_noise *s, const float *density, float *a, float *b, uint8_t *far, const size_t n[3]);

/* Computes the variance of the response -sigma^2 lap(G_sigma * noise) at fibers for each scale. Scales with too little
 * void continue the measured ones as sigma^-3, which is the law of noise whose correlation is shorter than the scale.
 * Returns false if the scan has no void to measure in. */
bool scale_noise_variance(const struct scale_noise *s, double var[N_SCALE]);

/* The same under the assumption of white noise, for scans without void: noise_var[voxel] times the sum of squares of
 * the response to one voxel. a, b: scratch of SCALE_EDGE^3 voxels. */
void scale_noise_white(double noise_var, float *a, float *b, double var[N_SCALE]);
/* Noise variance of a voxel in a brick. Second differences along all three axes at once remove nearly all of the
 * fibers (straight fibers perpendicular to an axis completely), and give 6^3 times the variance of white noise (after
 * Immerkaer 1996). For scans with correlated noise the result is too small. */
double scale_noise_of_voxels(const float *a, const size_t n[3]);

#endif
