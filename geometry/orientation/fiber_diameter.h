/* Measures the fiber diameter from a density volume before any fiber is known (scale selection after Lindeberg
 * 1998).
 *
 * On the axis of a bright cylinder of radius R the scale-normalised Laplacian -sigma^2 lap(G_sigma * V) is largest
 * at sigma = R / sqrt 2, in three dimensions as in two. The diameter follows from the scale at which the bright
 * ridges of the volume respond most strongly: the mean third power of the positive response has a peak there. Of
 * several peaks the finest is taken, because the coarser ones are yarns. Neighbours in a bundle and the scanner's
 * blur shift the result by about ten percent, which is accurate enough to choose filters; the radius of the fibers
 * is measured later. The contribution of noise is subtracted; its variance is measured from the finest differences,
 * in which fibers hardly appear. */
#ifndef SELVEDGE_GEOMETRY_FIBER_DIAMETER_H
#define SELVEDGE_GEOMETRY_FIBER_DIAMETER_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Diameter in voxels, between 2 and 24, from up to 12 bricks of 64^3 voxels with the most material. v: densities in
 * [0, 1]. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status fiber_diameter_measure(const struct volume *v, struct thread_pool *pool, const struct progress *progress,
                              double *diameter_voxel, struct error *err);

#endif
