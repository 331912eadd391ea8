#include "geometry/grade/unresolved_directions.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    EDGE = 64,     /* voxels of a brick */
    N_TERM = 6,    /* xx, yy, zz, xy, xz, yz */
    N_PASS = 2,    /* of the box along each axis */
    MAX_REACH = 16 /* voxels of half a box without its middle, so that a brick and its surroundings stay small */
};

struct average_job {
    const struct direction_volume *from;
    struct direction_volume *to;
    size_t n_brick[3];
    int reach;    /* voxels of half a box without its middle */
    float **term; /* one per thread: N_TERM values of each voxel of a brick and its surroundings */
};

/* A brick with the voxels around it on which it depends. */
struct surroundings {
    size_t from[3], n[3]; /* of the brick */
    size_t low[3], m[3];  /* with its surroundings */
};

static struct surroundings find_surroundings(const struct average_job *job, size_t i_brick)
{
    const size_t *n = job->from->n, margin = (size_t)(N_PASS * job->reach);
    const size_t at[3] = {i_brick % job->n_brick[0], i_brick / job->n_brick[0] % job->n_brick[1],
                          i_brick / (job->n_brick[0] * job->n_brick[1])};
    struct surroundings b;
    for (int a = 0; a < 3; a++) {
        b.from[a] = EDGE * at[a];
        b.n[a] = n[a] - b.from[a] < EDGE ? n[a] - b.from[a] : EDGE;
        b.low[a] = b.from[a] > margin ? b.from[a] - margin : 0;
        size_t end = b.from[a] + b.n[a] + margin;
        b.m[a] = (end < n[a] ? end : n[a]) - b.low[a];
    }
    return b;
}

static void read_terms(const struct direction_volume *d, const struct surroundings *b, float *term)
{
    const size_t n_voxel = volume_n_voxel(b->m);
    memset(term, 0, N_TERM * n_voxel * sizeof *term);
    for (size_t k = 0, p = 0; k < b->m[2]; k++)
        for (size_t j = 0; j < b->m[1]; j++)
            for (size_t i = 0; i < b->m[0]; i++, p++) {
                const size_t at = volume_index(d->n, b->low[0] + i, b->low[1] + j, b->low[2] + k);
                float e[3];
                if (d->density[at] == 0) continue;
                direction_volume_get(d, at, e);
                for (int a = 0; a < 3; a++) term[(size_t)a * n_voxel + p] = e[a] * e[a];
                term[3 * n_voxel + p] = e[0] * e[1];
                term[4 * n_voxel + p] = e[0] * e[2];
                term[5 * n_voxel + p] = e[1] * e[2];
            }
}

/* Replaces n values by the sums over `reach` values on both sides. */
static void sum_box(float *x, size_t n, size_t stride, size_t reach)
{
    float old[EDGE + 2 * N_PASS * MAX_REACH], sum = 0.0f;
    for (size_t i = 0; i < n; i++) old[i] = x[i * stride];
    for (size_t i = 0; i < n && i < reach; i++) sum += old[i];
    for (size_t i = 0; i < n; i++) {
        if (i + reach < n) sum += old[i + reach];
        if (i > reach) sum -= old[i - reach - 1];
        x[i * stride] = sum;
    }
}

static void sum_boxes(const struct surroundings *b, size_t reach, float *term)
{
    const size_t stride[3] = {1, b->m[0], b->m[0] * b->m[1]}, n_voxel = volume_n_voxel(b->m);
    for (int axis = 0; axis < 3; axis++) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (size_t t = 0; t < N_TERM; t++)
            for (size_t j = 0; j < b->m[v]; j++)
                for (size_t i = 0; i < b->m[u]; i++)
                    for (int pass = 0; pass < N_PASS; pass++)
                        sum_box(term + t * n_voxel + i * stride[u] + j * stride[v], b->m[axis], stride[axis], reach);
    }
}

static void average_brick(void *context, size_t i_brick, size_t i_thread)
{
    const struct average_job *job = context;
    const struct surroundings b = find_surroundings(job, i_brick);
    const size_t n_voxel = volume_n_voxel(b.m);
    float *term = job->term[i_thread];
    scratch_keep_within(job->from->space);
    read_terms(job->from, &b, term);
    sum_boxes(&b, (size_t)job->reach, term);
    for (size_t k = 0; k < b.n[2]; k++)
        for (size_t j = 0; j < b.n[1]; j++)
            for (size_t i = 0; i < b.n[0]; i++) {
                const size_t at = volume_index(job->from->n, b.from[0] + i, b.from[1] + j, b.from[2] + k);
                const float *s = term + volume_index(b.m, b.from[0] - b.low[0] + i, b.from[1] - b.low[1] + j,
                                                     b.from[2] - b.low[2] + k);
                job->to->density[at] = job->from->density[at];
                if (job->from->density[at] == 0) continue;
                double m[3][3] = {
                    {(double)s[0], (double)s[3 * n_voxel], (double)s[4 * n_voxel]},
                    {(double)s[3 * n_voxel], (double)s[n_voxel], (double)s[5 * n_voxel]},
                    {(double)s[4 * n_voxel], (double)s[5 * n_voxel], (double)s[2 * n_voxel]},
                };
                float vector[3][3], value[3];
                small_eigen_3(m, vector, value);
                direction_volume_set(job->to, at, vector[2]);
            }
}

/* Half of the box without its middle: two boxes of w voxels have a variance of (w^2 - 1) / 6. */
static int box_reach(double sd_voxel)
{
    return (int)fmin(MAX_REACH, fmax(0.0, round(0.5 * (sqrt(1.0 + 6.0 * sd_voxel * sd_voxel) - 1.0))));
}

status unresolved_directions_average(struct direction_volume *d, double diameter_voxel, struct thread_pool *pool,
                                     const struct progress *progress, struct error *err)
{
    const size_t n_thread = thread_pool_n_thread(pool);
    struct direction_volume to = {0};
    struct average_job job = {.from = d, .to = &to, .reach = box_reach(UNRESOLVED_SD_DIAMETERS * diameter_voxel)};
    const size_t edge = (size_t)(EDGE + 2 * N_PASS * job.reach);
    status s = direction_volume_init_in(&to, d->n, d->voxel_size_m, d->space, err);
    if (s != STATUS_OK) return s;
    for (int a = 0; a < 3; a++) job.n_brick[a] = (d->n[a] + EDGE - 1) / EDGE;
    job.term = calloc(n_thread, sizeof *job.term);
    for (size_t t = 0; t < n_thread && job.term != NULL && s == STATUS_OK; t++) {
        job.term[t] = malloc(N_TERM * edge * edge * edge * sizeof **job.term);
        if (job.term[t] == NULL) s = STATUS_NO_MEMORY;
    }
    if (job.term == NULL || s != STATUS_OK) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot average directions: out of memory");
    } else {
        s = thread_pool_run(pool, volume_n_voxel(job.n_brick), average_brick, &job, progress);
        if (s != STATUS_OK) error_set(err, s, "averaging directions was cancelled");
    }
    for (size_t t = 0; t < n_thread && job.term != NULL; t++) free(job.term[t]);
    free(job.term);
    if (s == STATUS_OK) {
        direction_volume_release(d);
        *d = to;
    } else {
        direction_volume_release(&to);
    }
    return s;
}
