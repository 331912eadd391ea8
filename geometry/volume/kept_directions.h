/* Directions of kept voxels alone, for grids so fine that five bytes for each voxel count: a bit for each voxel that is
 * kept, and as directions of these either the ones of a coarser grid, or a list without gaps. Directions are octahedral
 * coordinates, two of 16 bits (volume.h). */
#ifndef SELVEDGE_GEOMETRY_KEPT_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_KEPT_DIRECTIONS_H

#include "base/files/scratch_space.h"
#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Tasks that set bits have this many voxels, a multiple of the 64 of a word. */
enum { KEPT_TASK = 1 << 16, KEPT_WORD = 64 };

struct kept_directions {
    size_t n[3];
    uint64_t *kept;              /* a bit for each voxel, the lowest of word 0 for voxel 0 */
    const int16_t *coarse;       /* of the coarser grid, 2 for each of its voxels; NULL: a list. Not owned. */
    size_t n_coarse[3];          /* voxels of the coarser grid */
    uint32_t *holder[3];         /* along each axis, the voxel of the coarser grid that holds the centre of voxel i */
    size_t *before, n_listed;    /* of a list: number of kept voxels before each word, and of all */
    int16_t *octahedral;         /* of a list: 2 for each kept voxel */
    struct scratch_space *space; /* not owned */
};

/* Makes n voxels that are all empty. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status kept_directions_new(const size_t n[3], struct scratch_space *space, struct kept_directions **k,
                           struct error *err);
/* Once the bits are set, makes a list for the directions, which the caller then writes (kept_directions_listed).
 * STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status kept_directions_list(struct kept_directions *k, struct error *err);
void kept_directions_free(struct kept_directions *k);

static inline bool kept_directions_has(const struct kept_directions *k, size_t i_voxel)
{
    return (k->kept[i_voxel / KEPT_WORD] >> i_voxel % KEPT_WORD & 1) != 0;
}
/* Voxel of the coarser grid that holds the centre of a voxel. */
size_t kept_directions_holder(const struct kept_directions *k, size_t i_voxel);
/* Place in the list of the direction of a kept voxel. */
size_t kept_directions_place(const struct kept_directions *k, size_t i_voxel);
/* The coordinates of a kept voxel. */
const int16_t *kept_directions_code(const struct kept_directions *k, size_t i_voxel);

#endif
