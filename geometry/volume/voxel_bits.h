/* A set of voxels as bits, and the place of each of them in a list without gaps. */
#ifndef SELVEDGE_GEOMETRY_VOXEL_BITS_H
#define SELVEDGE_GEOMETRY_VOXEL_BITS_H

#include "base/files/scratch_space.h"
#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

/* Tasks that set bits without atomic operations have this many voxels, a multiple of the 64 of a word. */
enum { VOXEL_BITS_TASK = 1 << 16 };

struct voxel_bits {
    uint64_t *word;              /* the lowest bit of word 0 for voxel 0 */
    size_t *before;              /* voxels of the set before each word, once they are counted */
    size_t n_word, n_set;        /* n_set: voxels of the set, once they are counted */
    struct scratch_space *space; /* not owned */
};

/* Makes an empty set. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status voxel_bits_init(struct voxel_bits *b, size_t n_voxel, struct scratch_space *space, struct error *err);
void voxel_bits_release(struct voxel_bits *b);
/* Counts the voxels of a set that no longer changes. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status voxel_bits_count(struct voxel_bits *b, struct error *err);

static inline bool voxel_bits_has(const struct voxel_bits *b, size_t at)
{
    return (__atomic_load_n(&b->word[at / 64], __ATOMIC_RELAXED) >> at % 64 & 1) != 0;
}

static inline void voxel_bits_add(struct voxel_bits *b, size_t at) { b->word[at / 64] |= (uint64_t)1 << at % 64; }

/* The same where several threads add to one word. */
static inline void voxel_bits_add_shared(struct voxel_bits *b, size_t at)
{
    if (!voxel_bits_has(b, at)) __atomic_fetch_or(&b->word[at / 64], (uint64_t)1 << at % 64, __ATOMIC_RELAXED);
}

/* Number of voxels of a counted set before a voxel. */
static inline size_t voxel_bits_place(const struct voxel_bits *b, size_t at)
{
    const uint64_t lower = b->word[at / 64] & (((uint64_t)1 << at % 64) - 1);
    return b->before[at / 64] + (size_t)__builtin_popcountll(lower);
}

#endif
