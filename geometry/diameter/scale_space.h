/* The scales at which the response of bright ridges is measured, on bricks of a volume (Lindeberg 1998). */
#ifndef SELVEDGE_GEOMETRY_SCALE_SPACE_H
#define SELVEDGE_GEOMETRY_SCALE_SPACE_H

#include <math.h>
#include <stddef.h>

enum { N_SCALE = 20, SCALE_EDGE = 64 };

/* Standard deviation of the Gaussian of scale i: 0.7 .. 8.4 voxels. */
static inline double scale_sigma(int i) { return 0.7 * pow(1.14, i); }

/* Blurs a[n[2]][n[1]][n[0]] in place by a Gaussian, with edge values repeated; n at most SCALE_EDGE. b: scratch of the
 * same size. */
void scale_blur(float *a, float *b, const size_t n[3], double sigma);
/* Blurs a brick from scale i - 1 to scale i, which works because the variances of Gaussians add. For i = 0 the brick is
 * not blurred yet. */
void scale_blur_on(float *a, float *b, const size_t n[3], int i);

/* Returns minus the Laplacian at p by differences. sy, sz: steps from row to row and from slice to slice, in voxels. */
static inline float scale_minus_laplacian(const float *p, ptrdiff_t sy, ptrdiff_t sz)
{
    return 6.0f * p[0] - p[-1] - p[1] - p[-sy] - p[sy] - p[-sz] - p[sz];
}

#endif
