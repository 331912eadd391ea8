/* The line filter of Zhao et al. 2011 ("Building volumetric appearance models of fabric using micro CT imaging",
 * section 5):
 *     q(d, p) = -2 exp(-s r^2) + exp(-t r^2), where r is the distance of offset p from the line through the origin
 *     along d
 *     (in voxels), and J(x, d) = sum over p of q(d, p) V(x + p).
 *
 * A Gaussian of the distance from a line is the line integral of an isotropic Gaussian, so J is a sum along the
 * line,
 *     J(x, d) = -sum_k L(x + k d),  L = V * [2 sqrt(s/pi) exp(-s |p|^2) - sqrt(t/pi) exp(-t |p|^2)],
 * of about h interpolated samples instead of h^3 taps. Tables hold the taps of each direction of a set in runs of
 * eight along x.
 *
 * Differences from the paper: the filter is a line of length h in every direction instead of a cube of edge h. In a
 * cube the diagonals have up to sqrt 3 times as many taps, so they would win wherever fibers are packed densely.
 * Along the axes J and eps_J equal the paper's. Samples outside of the volume take the value at their mirror image
 * through x, which doubles the half of the line that has data; so directions at the faces are not biased. */
#ifndef SELVEDGE_GEOMETRY_LINE_FILTER_H
#define SELVEDGE_GEOMETRY_LINE_FILTER_H

#include "base/thread_pool.h"
#include "geometry/filter/direction_set.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

/* Computes L of the formula above; `out` is initialised here. STATUS_INVALID for s, t <= 0; STATUS_CANCELLED,
 * STATUS_NO_MEMORY. */
status line_filter_blur(const struct volume *v, double s, double t, struct thread_pool *pool,
                        const struct progress *progress, struct volume *out, struct error *err);

/* Voxels along an axis up to which L looks. */
size_t line_filter_blur_reach(double s, double t);

struct line_filter;

/* Makes the tables for lines of length h voxels in volumes of n voxels. STATUS_INVALID for h < 3 or > 63;
 * STATUS_TOO_LARGE for slices of 2^25 voxels and more; STATUS_NO_MEMORY. */
status line_filter_new(const struct direction_set *set, size_t h, const size_t n[3], struct line_filter **filter,
                       struct error *err);
void line_filter_free(struct line_filter *filter);
/* Number of floats that a thread needs for the neighbourhood of one voxel. They must be zero at first. */
size_t line_filter_scratch(const struct line_filter *filter);

/* Data for evaluating J at one voxel for many directions. */
struct line_filter_site {
    const float *centre;
    bool copied;
};
struct line_filter_site line_filter_at(const struct line_filter *filter, const struct volume *blurred, size_t i,
                                       size_t j, size_t k, float *scratch);
float line_filter_j(const struct line_filter *filter, const struct line_filter_site *site, size_t i_direction);

#endif
