/* Real spherical harmonics up to order SPHERE_MAX_ORDER and their rotation.
 *
 * Y(l, m) has the index l (l + 1) + m; m < 0 goes with the sine of the azimuth, m > 0 with its cosine, without the
 * Condon-Shortley phase: Y(1, -1), Y(1, 0), Y(1, 1) are y, z, x times sqrt(3 / 4 pi). They are orthonormal over the
 * sphere. Rotations follow Ivanic and Ruedenberg 1996, "Rotation matrices for real spherical harmonics. Direct
 * determination by recursion", J. Phys. Chem. 100, 6342, with the correction of 1998 (102, 9099).
 */
#ifndef SELVEDGE_RENDERER_SPHERE_HARMONICS_H
#define SELVEDGE_RENDERER_SPHERE_HARMONICS_H

#include <stddef.h>

enum {
    SPHERE_MAX_ORDER = 6,
    SPHERE_MAX_COUNT = (SPHERE_MAX_ORDER + 1) * (SPHERE_MAX_ORDER + 1),
    /* numbers of a rotation: blocks of (2 l + 1)^2, one after the other */
    SPHERE_MAX_ROTATION = (SPHERE_MAX_ORDER + 1) * (2 * SPHERE_MAX_ORDER + 1) * (2 * SPHERE_MAX_ORDER + 3) / 3
};

static inline size_t sphere_count(size_t order) { return (order + 1) * (order + 1); }

/* y[(order + 1)^2] at a unit direction d. */
void sphere_harmonics(size_t order, const float d[3], float *y);
/* Blocks of the rotation that takes the coefficients of a function f to those of f(R^T d), R having the given rows:
 * rows are the axes of a new frame in the old one, and the result are the coefficients in the new frame. Block l begins
 * at l (2 l - 1) (2 l + 1) / 3. */
void sphere_rotation(size_t order, const float row[3][3], float *rotation);
/* out = rotation * in; n_channel sets of coefficients of sphere_count(order) numbers each. */
void sphere_rotate(size_t order, const float *rotation, const float *in, size_t n_channel, float *out);
/* Zonal coefficients of the spherical Gaussian exp(sharpness (cos - 1)) about z, over its integral: z[order + 1], those
 * of Y(l, 0). sharpness 0: a constant. */
void sphere_gaussian_zonal(size_t order, double sharpness, float *z);

#endif
