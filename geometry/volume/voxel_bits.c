#include "geometry/volume/voxel_bits.h"

status voxel_bits_init(struct voxel_bits *b, size_t n_voxel, struct scratch_space *space, struct error *err)
{
    void *word = NULL;
    *b = (struct voxel_bits){.n_word = (n_voxel + 63) / 64, .space = space};
    status s = scratch_new(space, b->n_word * sizeof *b->word, "the voxels with directions", &word, err);
    b->word = word;
    return s;
}

void voxel_bits_release(struct voxel_bits *b)
{
    scratch_release(b->space, b->word);
    scratch_release(b->space, b->before);
    *b = (struct voxel_bits){0};
}

status voxel_bits_count(struct voxel_bits *b, struct error *err)
{
    void *before = NULL;
    status s = scratch_new(b->space, b->n_word * sizeof *b->before, "the voxels with directions", &before, err);
    b->before = before;
    if (s != STATUS_OK) return s;
    for (size_t w = 0; w < b->n_word; w++) {
        b->before[w] = b->n_set;
        b->n_set += (size_t)__builtin_popcountll(b->word[w]);
    }
    return s;
}
