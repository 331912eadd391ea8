/* The textures W_k: the directions in which the picture of the tile changes most with view and light. They are the
 * leading left singular vectors of a matrix whose columns are noisy pictures of the tile, by subspace iteration. Each
 * texel has one path a picture: its noise is independent of all others, so that it hardly enters what the pictures
 * have in common. */
#include "renderer/preview/appearance_table.h"
#include "renderer/preview/direction_grid.h"
#include "renderer/preview/table_walks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_RELATIVE 3.0f
enum { BASIS_VIEWS = APPEARANCE_BASIS_VIEWS, BASIS_ITERATIONS = 6, PURPOSE_BASIS = 1, PURPOSE_START = 2 };
enum { COLUMNS_OF_VIEW = 3 * TABLE_LIGHTS, N_COLUMN = BASIS_VIEWS * COLUMNS_OF_VIEW };

struct basis {
    const struct table_walks *walks;
    struct appearance_table *t;
    size_t n_texel;
    float *picture; /* N_COLUMN x n_texel */
    float *next;    /* n_basis x n_texel */
    float *spare;   /* n_texel for each thread */
};

static void random_direction(struct rng *rng, size_t n_side, double d[3])
{
    double square[2];
    for (int a = 0; a < 2; a++) square[a] = 0.02 + 0.96 * rng_double(rng);
    direction_grid_direction(square, n_side == 2 && rng_float(rng) < 0.5f ? 1 : 0, d);
}

static float mean_of(const float *picture, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += (double)picture[i];
    return (float)(sum / (double)n);
}

/* Means over 3 x 3 texels, with the weights (1, 2, 1) / 4 along both axes; the picture repeats. */
static void smooth(const struct appearance_table *t, const float *from, float *to)
{
    for (size_t y = 0; y < t->height; y++) {
        const float *row[3] = {from + (y + t->height - 1) % t->height * t->width, from + y * t->width,
                               from + (y + 1) % t->height * t->width};
        for (size_t x = 0; x < t->width; x++) {
            size_t left = (x + t->width - 1) % t->width, right = (x + 1) % t->width;
            float sum = 0.0f;
            for (int k = 0; k < 3; k++)
                sum += (k == 1 ? 2.0f : 1.0f) * (row[k][left] + 2.0f * row[k][x] + row[k][right]);
            to[y * t->width + x] = sum / 16.0f;
        }
    }
}

/* Makes a noisy picture fit for finding textures. A fiber that happens to throw the lamp's light into the camera is
 * many times as bright as its neighbours: what is above MOST_RELATIVE means is cut off, and the rest smoothed. That
 * changes the choice of textures only, not the weights that they get. What is left differs from the mean; it is so
 * scaled that a picture ten times as bright counts about three times. */
static void prepare_picture(const struct appearance_table *t, float *picture, float *spare)
{
    size_t n = t->width * t->height;
    float most = MOST_RELATIVE * mean_of(picture, n);
    for (size_t i = 0; i < n; i++) spare[i] = picture[i] < most ? picture[i] : most;
    smooth(t, spare, picture);
    float mean = mean_of(picture, n), scale = mean > 0.0f ? 1.0f / sqrtf(mean) : 0.0f;
    for (size_t i = 0; i < n; i++) picture[i] = scale * (picture[i] - mean);
}

static void trace_view(void *context, size_t i_view, size_t i_thread)
{
    const struct basis *b = context;
    const struct table_walks *w = b->walks;
    struct rng rng;
    double wo[3], wi[TABLE_LIGHTS][3];
    float rgb[TABLE_LIGHTS][3], *column = b->picture + i_view * COLUMNS_OF_VIEW * b->n_texel;
    table_walks_random(w, PURPOSE_BASIS, (uint32_t)i_view, UINT32_MAX, &rng);
    random_direction(&rng, w->n_side, wo);
    for (size_t k = 0; k < TABLE_LIGHTS; k++) random_direction(&rng, w->n_side, wi[k]);
    for (size_t i = 0; i < b->n_texel && !progress_cancelled(w->progress); i++) {
        table_walks_random(w, PURPOSE_BASIS, (uint32_t)i_view, (uint32_t)i, &rng);
        double x = (double)(i % b->t->width) + rng_double(&rng), y = (double)(i / b->t->width) + rng_double(&rng);
        const double at[2] = {x / (double)b->t->width * w->tile_mm[0], y / (double)b->t->height * w->tile_mm[1]};
        table_walks_trace(w, at, wo, wi, TABLE_LIGHTS, &rng, rgb);
        for (size_t k = 0; k < COLUMNS_OF_VIEW; k++)
            column[k * b->n_texel + i] = rgb[k / 3][k % 3] / (float)fabs(wi[k / 3][2]);
    }
    float *spare = b->spare + i_thread * b->n_texel;
    for (size_t k = 0; k < COLUMNS_OF_VIEW; k++) prepare_picture(b->t, column + k * b->n_texel, spare);
}

static float dot(const float *a, const float *b, size_t n)
{
    float sum[8] = {0};
    size_t i = 0;
    for (; i + 8 <= n; i += 8)
        for (size_t k = 0; k < 8; k++) sum[k] += a[i + k] * b[i + k];
    for (; i < n; i++) sum[0] += a[i] * b[i];
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

/* next_k = M (transpose(M) W_k), of texture k + 1. */
static void apply_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct basis *b = context;
    size_t n = b->n_texel, k = i_task + 1;
    const float *from = b->t->weight + k * n;
    float *to = b->next + k * n;
    memset(to, 0, n * sizeof *to);
    for (size_t c = 0; c < N_COLUMN; c++) {
        const float *picture = b->picture + c * n;
        float along = dot(picture, from, n);
        for (size_t i = 0; i < n; i++) to[i] += along * picture[i];
    }
}

/* Gram-Schmidt, twice for the sake of rounding; every texture gets a mean square of 1. */
static void make_orthonormal(float *texture, size_t n_basis, size_t n)
{
    for (size_t k = 0; k < n_basis; k++) {
        float *t = texture + k * n;
        for (size_t j = 0; j < 2 * k; j++) {
            const float *other = texture + j / 2 * n;
            float along = dot(t, other, n) / (float)n;
            for (size_t i = 0; i < n; i++) t[i] -= along * other[i];
        }
        float square = dot(t, t, n) / (float)n, scale = square > 0.0f ? 1.0f / sqrtf(square) : 0.0f;
        for (size_t i = 0; i < n; i++) t[i] *= scale;
    }
}

static void start(const struct basis *b)
{
    float *w = b->t->weight;
    for (size_t k = 0; k < b->t->n_basis; k++) {
        struct rng rng;
        table_walks_random(b->walks, PURPOSE_START, (uint32_t)k, 0, &rng);
        for (size_t i = 0; i < b->n_texel; i++) w[k * b->n_texel + i] = k == 0 ? 1.0f : rng_float(&rng) - 0.5f;
    }
    make_orthonormal(w, b->t->n_basis, b->n_texel);
}

static status iterate(struct basis *b, struct thread_pool *pool, struct error *err)
{
    size_t n_byte = b->t->n_basis * b->n_texel * sizeof *b->next;
    struct progress silent = progress_silent(b->walks->progress);
    start(b);
    memcpy(b->next, b->t->weight, n_byte);
    for (int i = 0; i < BASIS_ITERATIONS && b->t->n_basis > 1; i++) {
        if (thread_pool_run(pool, b->t->n_basis - 1, apply_task, b, &silent) != STATUS_OK)
            return error_set(err, STATUS_CANCELLED, "making tables was cancelled");
        make_orthonormal(b->next, b->t->n_basis, b->n_texel);
        memcpy(b->t->weight, b->next, n_byte);
    }
    return STATUS_OK;
}

status appearance_basis_make(const struct table_walks *w, struct thread_pool *pool, const struct progress *progress,
                             struct appearance_table *t, struct error *err)
{
    struct basis b = {.walks = w, .t = t, .n_texel = t->width * t->height};
    b.picture = calloc(N_COLUMN * b.n_texel, sizeof *b.picture);
    b.next = malloc(t->n_basis * b.n_texel * sizeof *b.next);
    b.spare = malloc(thread_pool_n_thread(pool) * b.n_texel * sizeof *b.spare);
    status s = b.picture != NULL && b.next != NULL && b.spare != NULL
                   ? STATUS_OK
                   : error_set(err, STATUS_NO_MEMORY, "cannot make tables: no memory");
    if (s == STATUS_OK &&
        (thread_pool_run(pool, BASIS_VIEWS, trace_view, &b, progress) != STATUS_OK || progress_cancelled(progress)))
        s = error_set(err, STATUS_CANCELLED, "making tables was cancelled");
    if (s == STATUS_OK) s = iterate(&b, pool, err);
    free(b.picture);
    free(b.next);
    free(b.spare);
    return s;
}
