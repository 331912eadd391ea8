#include "geometry/filter/consensus.h"
#include "base/small_matrix.h"

#include <string.h>

status consensus_init(struct consensus *c, const size_t n_voxel[3], size_t cell, struct scratch_space *space,
                      struct error *err)
{
    *c = (struct consensus){.cell = cell, .space = space};
    for (int a = 0; a < 3; a++) c->n[a] = (n_voxel[a] + cell - 1) / cell;
    void *tensor;
    status s = scratch_new(space, c->n[0] * c->n[1] * c->n[2] * sizeof *c->tensor, "the directions of neighbourhoods",
                           &tensor, err);
    c->tensor = tensor;
    return s;
}

void consensus_release(struct consensus *c)
{
    if (c == NULL) return;
    scratch_release(c->space, c->tensor);
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

struct blur_job {
    const struct consensus *c;
    float (*out)[6];
    int axis;
};

static void blur_layer(void *context, size_t layer, size_t i_thread)
{
    (void)i_thread;
    const struct blur_job *job = context;
    const struct consensus *c = job->c;
    size_t n_layer = c->n[0] * c->n[1], stride = job->axis == 0 ? 1 : job->axis == 1 ? c->n[0] : n_layer;
    scratch_keep_within(c->space);
    for (size_t i = layer * n_layer; i < (layer + 1) * n_layer; i++) {
        size_t x = i / stride % c->n[job->axis];
        const float *low = c->tensor[x > 0 ? i - stride : i],
                    *high = c->tensor[x + 1 < c->n[job->axis] ? i + stride : i];
        for (int m = 0; m < 6; m++) job->out[i][m] = 0.25f * low[m] + 0.5f * c->tensor[i][m] + 0.25f * high[m];
    }
}

status consensus_blur(struct consensus *c, int n_pass, struct thread_pool *pool, struct error *err)
{
    void *other;
    status s = scratch_new(c->space, c->n[0] * c->n[1] * c->n[2] * sizeof *c->tensor,
                           "the directions of neighbourhoods", &other, err);
    for (int pass = 0; pass < 3 * n_pass && s == STATUS_OK; pass++) {
        struct blur_job job = {c, other, pass % 3};
        s = thread_pool_run(pool, c->n[2], blur_layer, &job, NULL);
        other = c->tensor;
        c->tensor = job.out;
    }
    scratch_release(c->space, other);
    return s;
}

bool consensus_direction(const struct consensus *c, size_t i, size_t j, size_t k, float d[3])
{
    const float *t = c->tensor[cell_of(c, i, j, k)];
    if (!(t[0] + t[1] + t[2] > 0.0f)) return false;
    double m[3][3] = {{t[0], t[3], t[4]}, {t[3], t[1], t[5]}, {t[4], t[5], t[2]}};
    float vector[3][3], value[3];
    small_eigen_3(m, vector, value);
    memcpy(d, vector[2], sizeof vector[2]);
    return true;
}
