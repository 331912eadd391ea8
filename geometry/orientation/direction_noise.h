/* How restless the directions of a direction volume are. */
#ifndef SELVEDGE_GEOMETRY_DIRECTION_NOISE_H
#define SELVEDGE_GEOMETRY_DIRECTION_NOISE_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Mean angle, degrees, between the direction of a kept voxel and that of the next voxel along its axis class, where that one is kept, too:
 * along a fiber directions hardly change from voxel to voxel. NaN without such pairs. Slice by slice.
 * STATUS_CANCELLED, STATUS_NO_MEMORY. */
status direction_noise_measure(const struct direction_volume *d, struct thread_pool *pool,
                               const struct progress *progress, double *mean_deg, struct error *err);

#endif
