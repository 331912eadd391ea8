#include "geometry/volume/kept_directions.h"

#include <stdlib.h>
#include <string.h>

static size_t n_word(const struct kept_directions *k)
{
    return (k->n[0] * k->n[1] * k->n[2] + KEPT_WORD - 1) / KEPT_WORD;
}

status kept_directions_new(const size_t n[3], struct scratch_space *space, struct kept_directions **result,
                           struct error *err)
{
    void *kept = NULL;
    struct kept_directions *k = calloc(1, sizeof *k);
    *result = NULL;
    if (k == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep directions: out of memory");
    k->space = space;
    memcpy(k->n, n, sizeof k->n);
    status s = scratch_new(space, n_word(k) * sizeof *k->kept, "the voxels with directions", &kept, err);
    k->kept = kept;
    if (s != STATUS_OK) {
        kept_directions_free(k);
        return s;
    }
    *result = k;
    return STATUS_OK;
}

status kept_directions_list(struct kept_directions *k, struct error *err)
{
    void *before = NULL, *octahedral = NULL;
    status s = scratch_new(k->space, n_word(k) * sizeof *k->before, "the voxels with directions", &before, err);
    if (s != STATUS_OK) return s;
    k->before = before;
    for (size_t w = 0; w < n_word(k); w++) {
        k->before[w] = k->n_listed;
        k->n_listed += (size_t)__builtin_popcountll(k->kept[w]);
    }
    s = scratch_new(k->space, 2 * k->n_listed * sizeof *k->octahedral, "directions", &octahedral, err);
    k->octahedral = octahedral;
    return s;
}

void kept_directions_free(struct kept_directions *k)
{
    if (k == NULL) return;
    scratch_release(k->space, k->kept);
    scratch_release(k->space, k->before);
    scratch_release(k->space, k->octahedral);
    for (int a = 0; a < 3; a++) free(k->holder[a]);
    free(k);
}

size_t kept_directions_holder(const struct kept_directions *k, size_t i_voxel)
{
    const size_t i = k->holder[0][i_voxel % k->n[0]], j = k->holder[1][i_voxel / k->n[0] % k->n[1]],
                 slice = k->holder[2][i_voxel / (k->n[0] * k->n[1])];
    return (slice * k->n_coarse[1] + j) * k->n_coarse[0] + i;
}

size_t kept_directions_place(const struct kept_directions *k, size_t i_voxel)
{
    const uint64_t lower = k->kept[i_voxel / KEPT_WORD] & (((uint64_t)1 << i_voxel % KEPT_WORD) - 1);
    return k->before[i_voxel / KEPT_WORD] + (size_t)__builtin_popcountll(lower);
}

const int16_t *kept_directions_code(const struct kept_directions *k, size_t i_voxel)
{
    if (k->coarse != NULL) return k->coarse + 2 * kept_directions_holder(k, i_voxel);
    return k->octahedral + 2 * kept_directions_place(k, i_voxel);
}
