/* A Gaussian blur of a stack of slices that arrive in order: along x and y at once (periodic), along z when the slices
 * on both sides are there (used only in this folder). */
#ifndef SELVEDGE_GEOMETRY_SLICE_BLUR_H
#define SELVEDGE_GEOMETRY_SLICE_BLUR_H

#include "base/status.h"

#include <stddef.h>

struct slice_blur {
    float *kernel; /* 2 reach + 1 weights, whose sum is 1 */
    long reach;
    float *held; /* blurred along x and y; slice k at k % n_held */
    size_t n[3], n_held;
};

/* Number of slices on each side that a blur takes. */
long slice_blur_reach(double sd_voxel);
/* n: size of the stack; n_held: at least the slices processed together, and slice_blur_reach on both sides.
 * STATUS_NO_MEMORY. The caller releases it also then. */
status slice_blur_init(struct slice_blur *b, double sd_voxel, const size_t n[3], size_t n_held, struct error *err);
void slice_blur_release(struct slice_blur *b);
/* Takes slice k. row: room for one slice. */
void slice_blur_take(struct slice_blur *b, size_t k, const float *from, float *row);
/* Value at a voxel, with 0 below and above the stack. Needs slices k - reach .. k + reach. */
double slice_blur_at(const struct slice_blur *b, size_t i, size_t j, size_t k);
/* Standard deviation of the blurred value at slice k if the values were independent with standard deviation 1. */
double slice_blur_noise_sd(const struct slice_blur *b, size_t k);

#endif
