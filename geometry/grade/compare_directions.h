/* Compares a direction volume with the true fibers of a phantom.
 *
 * A voxel belongs to the true fiber whose axis is nearest to its centre, periodic in x and y. It lies inside of the
 * fiber if the distance is at most the fiber's radius, and in its rim up to twice that, as far as the transfer of
 * directions reaches (fabric thesis, 5.6.7). The rim holds the blurred surface of fibers, and noise. The error of a
 * voxel is the angle between its direction and the fiber's, without sign; emptied voxels have none. */
#ifndef SELVEDGE_GEOMETRY_COMPARE_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_COMPARE_DIRECTIONS_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

struct direction_error {
    double mean_deg, p95_deg; /* NaN without voxels; p95 to 0.1 degree */
    size_t n;                 /* voxels compared */
};

struct direction_compare {
    struct direction_error inside, rim;
    double kept_share; /* voxels inside of true fibers that are not emptied, over all voxels inside; NaN without */
};

/* The grid of d is the tile of the truth, with its corner at the origin. STATUS_INVALID (invalid fibers, none at
 * all), STATUS_NO_MEMORY. */
status compare_directions(const struct fiber_set *truth, const struct direction_volume *d, struct thread_pool *pool,
                          struct direction_compare *result, struct error *err);

#endif
