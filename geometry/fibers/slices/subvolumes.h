/* Masks of the voxels that belong to the slices of each frame. */
#ifndef SELVEDGE_GEOMETRY_SUBVOLUMES_H
#define SELVEDGE_GEOMETRY_SUBVOLUMES_H

#include "base/thread_pool.h"
#include "geometry/fibers/slices/slice_frame.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

/* Cosine of the largest angle between a voxel's direction and the normal of its slices, 39.6 degrees. */
#define CLASS_COSINE 0.77f

#define CLASS_KEPT 4096u

struct subvolumes {
    /* Two bytes per voxel: bit f is set if the voxel belongs to the slices of frame f, and bit 12 + a for the axis a
     * nearest to its direction. Voxels emptied by the filter have none of the latter (mask < CLASS_KEPT). */
    uint16_t *mask;
    size_t n_class_voxel[3]; /* number of kept voxels by nearest axis */
    size_t from[3], to[3];   /* box around the kept voxels, end exclusive; from == to if there are none */
    struct scratch_space *space;
};

/* disjoint: each voxel belongs to the frame of its nearest axis alone, one of the first three (fabric thesis, 5.6.1).
 * STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status subvolumes_init(struct subvolumes *s, const struct direction_volume *d, bool disjoint, struct thread_pool *pool,
                       struct error *err);
void subvolumes_release(struct subvolumes *s);

#endif
