/* A measure of the noise of a direction volume. */
#ifndef SELVEDGE_GEOMETRY_DIRECTION_NOISE_H
#define SELVEDGE_GEOMETRY_DIRECTION_NOISE_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Measures the mean angle in degrees between the directions of a kept voxel and of the next voxel along its axis class,
 * if the next one is kept too. Along a fiber directions hardly change from voxel to voxel, so a large angle is noise.
 * NaN if there are no such pairs. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status direction_noise_measure(const struct direction_volume *d, struct thread_pool *pool,
                               const struct progress *progress, double *mean_deg, struct error *err);

#endif
