#include "geometry/orientation/consensus.h"

#include "geometry/orientation/structure_tensor.h"

#include <stdlib.h>
#include <string.h>

status consensus_init(struct consensus *c, const size_t n_voxel[3], size_t cell, struct error *err)
{
    *c = (struct consensus){.cell = cell};
    for (int a = 0; a < 3; a++) c->n[a] = (n_voxel[a] + cell - 1) / cell;
    c->tensor = calloc(c->n[0] * c->n[1] * c->n[2], sizeof *c->tensor);
    return c->tensor != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
}

void consensus_release(struct consensus *c)
{
    if (c == NULL) return;
    free(c->tensor);
    *c = (struct consensus){0};
}

static size_t cell_of(const struct consensus *c, size_t i, size_t j, size_t k)
{
    return (k / c->cell * c->n[1] + j / c->cell) * c->n[0] + i / c->cell;
}

void consensus_add(struct consensus *c, size_t i, size_t j, size_t k, const float d[3], float weight)
{
    float *t = c->tensor[cell_of(c, i, j, k)];
    t[0] += weight * d[0] * d[0];
    t[1] += weight * d[1] * d[1];
    t[2] += weight * d[2] * d[2];
    t[3] += weight * d[0] * d[1];
    t[4] += weight * d[0] * d[2];
    t[5] += weight * d[1] * d[2];
}

status consensus_blur(struct consensus *c, int n_pass, struct error *err)
{
    size_t total = c->n[0] * c->n[1] * c->n[2];
    float(*other)[6] = malloc(total * sizeof *other);
    if (other == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    const size_t stride[3] = {1, c->n[0], c->n[0] * c->n[1]};
    for (int pass = 0; pass < 3 * n_pass; pass++) {
        int a = pass % 3;
        for (size_t i = 0; i < total; i++) {
            size_t x = i / stride[a] % c->n[a];
            const float *low = c->tensor[x > 0 ? i - stride[a] : i], *high = c->tensor[x + 1 < c->n[a] ? i + stride[a] : i];
            for (int m = 0; m < 6; m++) other[i][m] = 0.25f * low[m] + 0.5f * c->tensor[i][m] + 0.25f * high[m];
        }
        float(*t)[6] = c->tensor;
        c->tensor = other;
        other = t;
    }
    free(other);
    return STATUS_OK;
}

bool consensus_direction(const struct consensus *c, size_t i, size_t j, size_t k, float d[3])
{
    const float *t = c->tensor[cell_of(c, i, j, k)];
    if (!(t[0] + t[1] + t[2] > 0.0f)) return false;
    double m[3][3] = {{t[0], t[3], t[4]}, {t[3], t[1], t[5]}, {t[4], t[5], t[2]}};
    float vector[3][3], value[3];
    symmetric_eigen(m, vector, value);
    memcpy(d, vector[2], sizeof vector[2]);
    return true;
}
