/* Directions of kept voxels alone, for grids so fine that five bytes for each voxel count: a bit for each voxel that is
 * kept, and as directions of these either the ones of a coarser grid, or a list without gaps. Directions are octahedral
 * coordinates, two of 16 bits (volume.h). */
#ifndef SELVEDGE_GEOMETRY_KEPT_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_KEPT_DIRECTIONS_H

#include "geometry/volume/voxel_bits.h"

struct kept_directions {
    size_t n[3];
    struct voxel_bits kept;
    const int16_t *coarse;       /* of the coarser grid, 2 for each of its voxels; NULL: a list. Not owned. */
    size_t n_coarse[3];          /* voxels of the coarser grid */
    uint32_t *holder[3];         /* along each axis, the voxel of the coarser grid that holds the centre of voxel i */
    int16_t *octahedral;         /* of a list: 2 for each kept voxel */
    struct scratch_space *space; /* not owned */
};

/* Makes n voxels that are all empty. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status kept_directions_new(const size_t n[3], struct scratch_space *space, struct kept_directions **k,
                           struct error *err);
/* Once the bits are set, makes a list for the directions, which the caller then writes (voxel_bits_place).
 * STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status kept_directions_list(struct kept_directions *k, struct error *err);
void kept_directions_free(struct kept_directions *k);
/* Voxel of the coarser grid that holds the centre of a voxel. */
size_t kept_directions_holder(const struct kept_directions *k, size_t i_voxel);
/* The coordinates of a kept voxel. */
const int16_t *kept_directions_code(const struct kept_directions *k, size_t i_voxel);

#endif
