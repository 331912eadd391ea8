/* Small direction volumes made by hand for the volume tracer's tests. Release with direction_volume_release. */
#ifndef SELVEDGE_TESTS_HAND_VOLUME_H
#define SELVEDGE_TESTS_HAND_VOLUME_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

/* The same density and direction everywhere. Like the other functions, it aborts the test when memory runs out. */
void hand_volume_uniform(struct direction_volume *v, const size_t n[3], double voxel_m, uint8_t density,
                         const float direction[3]);
/* Two crossed systems of wavy fibers with gaps between them. A share `occupancy` of the voxels is not empty. */
void hand_volume_weave(struct direction_volume *v, const size_t n[3], double voxel_m, double occupancy);
/* Makes a volume of fibers far thinner than a voxel. The density of a voxel is the share of it that fibers fill, times
 * `scale`, so that a byte can represent it. Sample points along the fibers are counted, so the density is right on
 * average. z = 0 of f is the bottom of the volume. */
void hand_volume_rasterise(struct direction_volume *v, const size_t n[3], double voxel_m, const struct fiber_set *f,
                           double scale);

#endif
