#include "renderer/fast/precompute/distance_components.h"
#include "base/rng.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_EXTRA = 8, N_ITERATION = 3, COLUMN_BLOCK = 128, MOST = 48 + N_EXTRA };

struct subspace {
    const float *x;
    size_t n, n_number, n_vector;
    float *q; /* n_vector x n_number */
    float *y; /* n x n_vector */
};

/* y = x q' for a block of rows. */
static void project_rows(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct subspace *s = context;
    for (size_t i = i_task * COLUMN_BLOCK; i < (i_task + 1) * COLUMN_BLOCK && i < s->n; i++)
        for (size_t k = 0; k < s->n_vector; k++) {
            const float *x = s->x + i * s->n_number, *q = s->q + k * s->n_number;
            float sum[8] = {0};
            for (size_t p = 0; p + 8 <= s->n_number; p += 8)
                for (size_t l = 0; l < 8; l++) sum[l] += x[p + l] * q[p + l];
            float all = 0;
            for (size_t l = 0; l < 8; l++) all += sum[l];
            for (size_t p = s->n_number / 8 * 8; p < s->n_number; p++) all += x[p] * q[p];
            s->y[i * s->n_vector + k] = all;
        }
}

/* q = y' x for a block of columns. */
static void collect_columns(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct subspace *s = context;
    size_t first = i_task * COLUMN_BLOCK,
           last = first + COLUMN_BLOCK < s->n_number ? first + COLUMN_BLOCK : s->n_number;
    for (size_t k = 0; k < s->n_vector; k++) memset(s->q + k * s->n_number + first, 0, (last - first) * sizeof *s->q);
    for (size_t i = 0; i < s->n; i++)
        for (size_t k = 0; k < s->n_vector; k++) {
            float y = s->y[i * s->n_vector + k], *q = s->q + k * s->n_number;
            const float *x = s->x + i * s->n_number;
            for (size_t p = first; p < last; p++) q[p] += y * x[p];
        }
}

static double inner(const float *a, const float *b, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += (double)(a[i] * b[i]);
    return sum;
}

/* Modified Gram-Schmidt, twice; vectors without anything new become 0. */
static void make_orthonormal(struct subspace *s)
{
    for (size_t k = 0; k < s->n_vector; k++) {
        float *q = s->q + k * s->n_number;
        double length = sqrt(inner(q, q, s->n_number));
        for (int twice = 0; twice < 2; twice++)
            for (size_t j = 0; j < k; j++) {
                const float *o = s->q + j * s->n_number;
                float along = (float)inner(q, o, s->n_number);
                for (size_t p = 0; p < s->n_number; p++) q[p] -= along * o[p];
            }
        double left = sqrt(inner(q, q, s->n_number));
        float inv = left > 1e-4 * length && left > 0.0 ? (float)(1.0 / left) : 0;
        for (size_t p = 0; p < s->n_number; p++) q[p] *= inv;
    }
}

/* The strongest directions within the subspace, in order. */
static void turn_to_axes(const struct subspace *s, size_t n_component, float *component)
{
    size_t m = s->n_vector;
    double c[MOST * MOST] = {0.0}, value[MOST], v[MOST * MOST];
    for (size_t i = 0; i < s->n; i++)
        for (size_t a = 0; a < m; a++)
            for (size_t b = 0; b < m; b++) c[a * m + b] += (double)s->y[i * m + a] * (double)s->y[i * m + b];
    small_eigen(c, m, value, v);
    for (size_t k = 0; k < n_component; k++) {
        size_t best = 0;
        for (size_t a = 1; a < m; a++)
            if (value[a] > value[best]) best = a;
        float *out = component + k * s->n_number;
        memset(out, 0, s->n_number * sizeof *out);
        for (size_t a = 0; a < m && value[best] > 0.0; a++)
            for (size_t p = 0; p < s->n_number; p++) out[p] += (float)v[a * m + best] * s->q[a * s->n_number + p];
        value[best] = -1.0;
    }
}

static void subtract_mean(float *x, size_t n, size_t n_number, float *mean)
{
    for (size_t p = 0; p < n_number; p++) {
        double sum = 0.0;
        for (size_t i = 0; i < n; i++) sum += (double)x[i * n_number + p];
        mean[p] = (float)(sum / (double)n);
        for (size_t i = 0; i < n; i++) x[i * n_number + p] -= mean[p];
    }
}

status distance_components(float *x, size_t n, size_t n_number, size_t n_component, struct thread_pool *pool,
                           float *mean, float *component, struct error *err)
{
    struct subspace s = {.x = x, .n = n, .n_number = n_number, .n_vector = n_component + N_EXTRA};
    s.q = malloc(s.n_vector * n_number * sizeof *s.q);
    s.y = malloc(n * s.n_vector * sizeof *s.y);
    status st = s.q != NULL && s.y != NULL
                    ? STATUS_OK
                    : error_set(err, STATUS_NO_MEMORY, "cannot find principal components: out of memory");
    size_t n_row_task = (n + COLUMN_BLOCK - 1) / COLUMN_BLOCK,
           n_column_task = (n_number + COLUMN_BLOCK - 1) / COLUMN_BLOCK;
    if (st == STATUS_OK) {
        struct rng rng;
        rng_start(&rng, &(struct rng_key){.seed = 0x636f6d70u}, 0, 0);
        for (size_t i = 0; i < s.n_vector * n_number; i++) s.q[i] = rng_float(&rng) - 0.5f;
        if (mean != NULL) subtract_mean(x, n, n_number, mean);
        make_orthonormal(&s);
    }
    for (int i = 0; i < N_ITERATION && st == STATUS_OK; i++) {
        st = thread_pool_run(pool, n_row_task, project_rows, &s, NULL);
        if (st == STATUS_OK) st = thread_pool_run(pool, n_column_task, collect_columns, &s, NULL);
        if (st == STATUS_OK) make_orthonormal(&s);
    }
    if (st == STATUS_OK) st = thread_pool_run(pool, n_row_task, project_rows, &s, NULL);
    if (st == STATUS_OK) turn_to_axes(&s, n_component, component);
    free(s.q);
    free(s.y);
    return st;
}
