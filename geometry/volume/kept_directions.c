#include "geometry/volume/kept_directions.h"

#include <stdlib.h>
#include <string.h>

status kept_directions_new(const size_t n[3], struct scratch_space *space, struct kept_directions **result,
                           struct error *err)
{
    struct kept_directions *k = calloc(1, sizeof *k);
    *result = NULL;
    if (k == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep directions: out of memory");
    k->space = space;
    memcpy(k->n, n, sizeof k->n);
    status s = voxel_bits_init(&k->kept, n[0] * n[1] * n[2], space, err);
    if (s != STATUS_OK) {
        kept_directions_free(k);
        return s;
    }
    *result = k;
    return STATUS_OK;
}

status kept_directions_list(struct kept_directions *k, struct error *err)
{
    void *octahedral = NULL;
    status s = voxel_bits_count(&k->kept, err);
    if (s != STATUS_OK) return s;
    s = scratch_new(k->space, 2 * k->kept.n_set * sizeof *k->octahedral, "directions", &octahedral, err);
    k->octahedral = octahedral;
    return s;
}

void kept_directions_free(struct kept_directions *k)
{
    if (k == NULL) return;
    voxel_bits_release(&k->kept);
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

const int16_t *kept_directions_code(const struct kept_directions *k, size_t i_voxel)
{
    if (k->coarse != NULL) return k->coarse + 2 * kept_directions_holder(k, i_voxel);
    return k->octahedral + 2 * voxel_bits_place(&k->kept, i_voxel);
}
