/* Small direction volumes made by hand for the volume tracer's tests. Release with direction_volume_release. */
#ifndef SELVEDGE_TESTS_HAND_VOLUME_H
#define SELVEDGE_TESTS_HAND_VOLUME_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

/* The same density and direction everywhere. Aborts the test without memory, like the others. */
void hand_volume_uniform(struct direction_volume *v, const size_t n[3], double voxel_m, uint8_t density,
                         const float direction[3]);
/* Two crossed systems of wavy fibers with gaps between them; `occupancy` of the voxels hold something. */
void hand_volume_weave(struct direction_volume *v, const size_t n[3], double voxel_m, double occupancy);
/* Share of each voxel that fibers fill, for fibers far thinner than a voxel, times `scale` (so that bytes resolve it).
 * Points are spread along the fibers, so density times scale is right on the average; f's z = 0 is the bottom of the
 * volume. */
void hand_volume_rasterise(struct direction_volume *v, const size_t n[3], double voxel_m, const struct fiber_set *f,
                           double scale);

#endif
