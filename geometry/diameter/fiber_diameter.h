/* Measures the fiber diameter from a density volume before any fiber is known (scale selection after Lindeberg
 * 1998).
 *
 * On the axis of a bright cylinder of radius R the scale-normalised Laplacian -sigma^2 lap(G_sigma * V) is largest
 * at sigma = R / sqrt 2, in three dimensions as in two. The diameter follows from the scale at which the bright
 * ridges of the volume respond most strongly: the mean third power of the positive response has a peak there. Of
 * several peaks the finest is taken, because the coarser ones are yarns. Neighbours in a bundle and the scanner's
 * blur shift the result by about ten percent, which is accurate enough to choose filters; the radius of each fiber
 * is measured later.
 *
 * The contribution of noise is subtracted at each scale. It is measured in the void of the same scan, because the noise
 * of a reconstructed scan is correlated and then has a peak of its own at two to four voxels. A peak to which noise
 * contributes more than half is taken only if there is no other. A peak of fibers may be no more than a shoulder on the
 * slope of their yarns' peak; it is found in the energy over sigma, because the energy of outlines grows as sigma or
 * faster below its peak (geometry/NOTES.md). Where noise is more than half of the response at some scale well below the
 * chosen one, fibers may be hidden there: the response at the finer scales is then measured a second time, in bricks
 * that are blurred by half a voxel, and the finest peak that stands out of the noise there is taken instead. */
#ifndef SELVEDGE_GEOMETRY_FIBER_DIAMETER_H
#define SELVEDGE_GEOMETRY_FIBER_DIAMETER_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

/* Ratio of a diameter to the diameter of fibers that noise may hide below it. */
#define FIBER_DIAMETER_FINER 1.5

struct fiber_diameter {
    double voxel;       /* the diameter chosen, between 2 and 24 voxels */
    double noise_share; /* share of the response at its scale that is noise, 0 .. 1 */
    /* The next best peak, NaN if there is none: a finer one that is mostly noise, or a coarser one, such as the peak of
     * yarns, that responds more strongly than the chosen one or was passed over for it. */
    double other_voxel, other_noise_share;
    bool hidden;         /* found in the blurred scan alone; other_voxel: diameter in the scan itself */
    bool noise_measured; /* in void; else there is none, and the noise is taken as white */
};

/* Measures in up to 12 bricks of 64^3 voxels with the most material. v: densities, clamped to [0, 1] or not.
 * STATUS_CANCELLED, STATUS_NO_MEMORY. */
status fiber_diameter_measure(const struct volume *v, struct thread_pool *pool, const struct progress *progress,
                              struct fiber_diameter *diameter, struct error *err);

#endif
