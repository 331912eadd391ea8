/* Directions of voxels where a scan does not resolve single fibers.
 *
 * There the line that is nearest to a voxel is one that the scan does not show, and may cross the yarn. The scan does
 * show how the yarn runs, so each voxel takes the mean direction of the voxels around it: the main axis of the mean
 * tensor d d^T (d: unit direction), because a direction and its opposite are the same. The mean is weighted by a box
 * that is applied twice along each axis, whose standard deviation is UNRESOLVED_SD_DIAMETERS. */
#ifndef SELVEDGE_GEOMETRY_UNRESOLVED_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_UNRESOLVED_DIRECTIONS_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#define UNRESOLVED_SD_DIAMETERS 0.5

/* Replaces the directions of *d, and needs memory for a second volume meanwhile. Emptied voxels count nothing and stay
 * empty. diameter_voxel: of a fiber. The result does not depend on the number of threads. STATUS_NO_MEMORY,
 * STATUS_CANCELLED, STATUS_IO of the scratch space. */
status unresolved_directions_average(struct direction_volume *d, double diameter_voxel, struct thread_pool *pool,
                                     const struct progress *progress, struct error *err);

#endif
