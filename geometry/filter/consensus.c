#include "geometry/filter/consensus.h"
#include "base/small_matrix.h"

#include <stdlib.h>
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
    struct consensus *c;
    int axis;
    float (*before)[6]; /* per thread: the cells of a row before they were blurred */
};

/* Blurs the cells of n lines that begin side by side at `first`, step by step along the lines. */
static void blur_lines(const struct blur_job *job, size_t first, size_t n, size_t stride, float (*before)[6])
{
    float(*t)[6] = job->c->tensor + first;
    const size_t last = job->c->n[job->axis] - 1;
    memcpy(before, t, n * sizeof *before);
    for (size_t x = 0; x <= last; x++, t += stride)
        for (size_t i = 0; i < n; i++)
            for (int m = 0; m < 6; m++) {
                const float own = t[i][m], high = x < last ? t[i + stride][m] : own;
                t[i][m] = 0.25f * before[i][m] + 0.5f * own + 0.25f * high;
                before[i][m] = own;
            }
}

/* Layers along x and y, and rows of columns along z. */
static void blur_task(void *context, size_t i_task, size_t i_thread)
{
    const struct blur_job *job = context;
    const size_t *n = job->c->n, n_layer = n[0] * n[1];
    float(*before)[6] = job->before + i_thread * n[0];
    scratch_keep_within(job->c->space);
    if (job->axis == 0)
        for (size_t y = 0; y < n[1]; y++) blur_lines(job, i_task * n_layer + y * n[0], 1, 1, before);
    else if (job->axis == 1)
        blur_lines(job, i_task * n_layer, n[0], n[0], before);
    else
        blur_lines(job, i_task * n[0], n[0], n_layer, before);
}

status consensus_blur(struct consensus *c, int n_pass, struct thread_pool *pool, struct error *err)
{
    struct blur_job job = {.c = c, .before = malloc(thread_pool_n_thread(pool) * c->n[0] * sizeof *job.before)};
    status s = STATUS_OK;
    if (job.before == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    for (int pass = 0; pass < 3 * n_pass && s == STATUS_OK; pass++) {
        job.axis = pass % 3;
        s = thread_pool_run(pool, job.axis < 2 ? c->n[2] : c->n[1], blur_task, &job, NULL);
    }
    free(job.before);
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
