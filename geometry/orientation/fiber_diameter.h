/* Fiber diameter measured from a density volume before any fiber is known (scale selection after Lindeberg 1998).
 *
 * On the axis of a bright cylinder of radius R the scale-normalised Laplacian -sigma^2 lap(G_sigma * V) is largest at
 * sigma = R / sqrt 2, in three dimensions as in two. The scale at which the bright ridges of the volume answer most
 * strongly (mean third power of the positive part; the finest such scale, coarser ones are yarns) gives the diameter. Neighbours in a
 * bundle and the scanner's blur shift it by some ten percent, which is near enough for choosing filters. The radius that the fibers get is measured later.
 * What noise adds to the answers is taken off: its variance is measured at the finest differences, which fibers hardly touch.
 */
#ifndef SELVEDGE_GEOMETRY_FIBER_DIAMETER_H
#define SELVEDGE_GEOMETRY_FIBER_DIAMETER_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Diameter in voxels, between 2 and 24, from up to 12 bricks of 64 voxels a side with the most material. v: densities in [0, 1].
 * STATUS_CANCELLED, STATUS_NO_MEMORY. */
status fiber_diameter_measure(const struct volume *v, struct thread_pool *pool, const struct progress *progress,
                              double *diameter_voxel, struct error *err);

#endif
