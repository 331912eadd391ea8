/* Which voxels show in the slices of which frame. */
#ifndef SELVEDGE_GEOMETRY_SUBVOLUMES_H
#define SELVEDGE_GEOMETRY_SUBVOLUMES_H

#include "base/thread_pool.h"
#include "geometry/fibers/slices/slice_frame.h"
#include "geometry/volume/volume.h"

#define CLASS_COSINE                                                                                                   \
    0.77f /* of the largest angle between a voxel's direction and the normal of its slices, 39.6 degrees */

#define CLASS_KEPT 4096u

struct subvolumes {
    /* Two bytes a voxel: bit f set when the voxel shows in slices of frame f, bit 12 + a for the axis nearest to its direction;
     * voxels emptied by the filter have none of the latter (mask < CLASS_KEPT). */
    uint16_t *mask;
    size_t n_class_voxel[3]; /* kept voxels by nearest axis */
    size_t from[3], to[3];   /* box around the kept voxels, end exclusive; from == to when there are none */
    struct scratch_space *space;
};

/* STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status subvolumes_init(struct subvolumes *s, const struct direction_volume *d, struct thread_pool *pool,
                       struct error *err);
void subvolumes_release(struct subvolumes *s);

#endif
