#include "renderer/estimate/contrast_blocks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK_PATHS = RADIANCE_BLOCK_PATHS, TASK_PATHS = 4096, N_JAC = 3 * SCATTERING_MAX_FLAT };

/* ---- sums: for each cell and set the values, their squares, the products of derivatives with their channel ---- */

static size_t set_size(const struct contrast_plan *c) { return 2 * (3 + c->n_jac) + c->n_jac; }

static double *sums_of(const struct contrast_plan *c, size_t i_cell, size_t i_set)
{
    return c->sum + (2 * i_cell + i_set) * set_size(c);
}

status contrast_plan_init(struct contrast_plan *c, size_t n_side, size_t n_path, size_t n_jac, struct error *err)
{
    *c = (struct contrast_plan){.n_side = n_side, .n_cell = n_side * n_side, .n_jac = n_jac};
    size_t per_cell = n_path / c->n_cell + (n_path % c->n_cell != 0);
    c->n_half = per_cell > 4 ? per_cell / 2 + per_cell % 2 : 2;
    c->cells_per_task = 2 * c->n_half < TASK_PATHS ? TASK_PATHS / (2 * c->n_half) : 1;
    c->n_task = (c->n_cell + c->cells_per_task - 1) / c->cells_per_task;
    c->blocks_per_task = (c->cells_per_task * 2 * c->n_half + BLOCK_PATHS - 1) / BLOCK_PATHS;
    c->sum = calloc(2 * c->n_cell, set_size(c) * sizeof *c->sum);
    if (c->sum == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot estimate contrast: no memory for %zu cells", c->n_cell);
    return STATUS_OK;
}

void contrast_plan_release(struct contrast_plan *c)
{
    free(c->sum);
    c->sum = NULL;
}

size_t contrast_task_sums(const struct contrast_plan *c, size_t i_task, double **sum)
{
    size_t first = i_task * c->cells_per_task, n = c->n_cell - first;
    *sum = sums_of(c, first, 0);
    return (n < c->cells_per_task ? n : c->cells_per_task) * 2 * set_size(c);
}

static void add_path(const struct contrast_plan *c, const float *value, double *sum)
{
    size_t n = 3 + c->n_jac, n_param = c->n_jac / 3;
    for (size_t k = 0; k < n; k++) {
        double v = (double)value[k];
        sum[k] += v;
        sum[n + k] += v * v;
        if (k >= 3) sum[2 * n + k - 3] += v * (double)value[(k - 3) / n_param];
    }
}

/* Places the paths of a block at random in their cells. */
static void start_paths(const struct contrast_plan *c, const struct rng_key *key, uint32_t i_block, size_t n,
                        const size_t *i_cell, struct rng *rng, double (*xy)[2])
{
    for (uint32_t i = 0; i < n; i++) {
        rng_start(&rng[i], key, i_block, i);
        xy[i][0] = ((double)(i_cell[i] % c->n_side) + rng_double(&rng[i])) / (double)c->n_side;
        xy[i][1] = ((double)(i_cell[i] / c->n_side) + rng_double(&rng[i])) / (double)c->n_side;
    }
}

uint64_t contrast_trace_task(const struct estimate_blocks *b, const struct contrast_plan *c, size_t i_group,
                             size_t i_task, float *value)
{
    struct rng_key key = b->key;
    size_t n_value = 3 + c->n_jac, first = i_task * c->cells_per_task, per_cell = 2 * c->n_half;
    size_t n_cell = c->n_cell - first < c->cells_per_task ? c->n_cell - first : c->cells_per_task;
    size_t n_path = n_cell * per_cell, i_cell[BLOCK_PATHS];
    uint64_t n_bounce = 0;
    struct rng rng[BLOCK_PATHS];
    double xy[BLOCK_PATHS][2];
    key.configuration = (uint32_t)i_group;
    for (size_t done = 0; done < n_path && !progress_cancelled(b->progress); done += BLOCK_PATHS) {
        size_t n = n_path - done < BLOCK_PATHS ? n_path - done : BLOCK_PATHS;
        for (size_t i = 0; i < n; i++) i_cell[i] = first + (done + i) / per_cell;
        start_paths(c, &key, (uint32_t)(i_task * c->blocks_per_task + done / BLOCK_PATHS), n, i_cell, rng, xy);
        n_bounce += estimate_trace(b, i_group, n, xy, rng, value);
        for (size_t i = 0; i < n; i++) add_path(c, value + i * n_value, sums_of(c, i_cell[i], (done + i) % 2));
    }
    return n_bounce;
}

/* ---- from sums to the contrast ---- */

/* Means over all cells of both sets. */
static void crop_means(const struct contrast_plan *c, double mean[2][3 + N_JAC])
{
    size_t n = 3 + c->n_jac;
    memset(mean, 0, 2 * sizeof mean[0]);
    for (size_t i = 0; i < c->n_cell; i++)
        for (size_t s = 0; s < 2; s++)
            for (size_t k = 0; k < n; k++) mean[s][k] += sums_of(c, i, s)[k];
    for (size_t k = 0; k < 2 * n; k++) mean[k / n][k % n] /= (double)c->n_cell * (double)c->n_half;
}

/* Covariance of the means of two values over n paths, from their sums and the sum of their product. */
static double mean_covariance(double x, double y, double xy, double n) { return (xy - x * y / n) / ((n - 1.0) * n); }

/* Terms of one cell for channel `channel` and for one derivative of it (value `k`; k = channel: no derivative). */
struct cell {
    double value[2], slope[2]; /* means minus the means of the crop */
    double var[2], slope_var[2], covariance[2];
};

static struct cell look_at(const struct contrast_plan *c, double mean[2][3 + N_JAC], size_t i, size_t channel, size_t k)
{
    struct cell out = {{0}, {0}, {0}, {0}, {0}};
    size_t n_value = 3 + c->n_jac;
    double n = (double)c->n_half;
    for (size_t s = 0; s < 2; s++) {
        const double *x = sums_of(c, i, s);
        out.value[s] = x[channel] / n - mean[s][channel];
        out.var[s] = fmax(0.0, mean_covariance(x[channel], x[channel], x[n_value + channel], n));
        if (k < 3) continue;
        // cppcheck-suppress arrayIndexOutOfBoundsCond ; k is at most 2 + N_JAC
        out.slope[s] = x[k] / n - mean[s][k];
        out.slope_var[s] = fmax(0.0, mean_covariance(x[k], x[k], x[n_value + k], n));
        out.covariance[s] = mean_covariance(x[channel], x[k], x[2 * n_value + k - 3], n);
    }
    return out;
}

static void reduce_channel(const struct contrast_plan *c, double mean[2][3 + N_JAC], size_t channel, struct estimate *e)
{
    double a = mean[0][channel], b = mean[1][channel], n = (double)c->n_cell, square = a * b;
    double numerator = 0.0, var = 0.0, shared = 0.0;
    for (size_t i = 0; i < c->n_cell; i++) {
        struct cell k = look_at(c, mean, i, channel, channel);
        numerator += k.value[0] * k.value[1] / (n - 1.0);
    }
    double contrast = numerator / square, scale = 1.0 / ((n - 1.0) * square);
    for (size_t i = 0; i < c->n_cell; i++) {
        struct cell k = look_at(c, mean, i, channel, channel);
        for (size_t s = 0; s < 2; s++) {
            double by_value = scale * k.value[1 - s] - contrast / (n * mean[s][channel]);
            var += by_value * by_value * k.var[s];
        }
        shared += scale * scale * k.var[0] * k.var[1];
    }
    e->mean[channel] = contrast;
    e->var[channel] = fmax(var - shared, 0.5 * shared);
}

static void reduce_derivative(const struct contrast_plan *c, double mean[2][3 + N_JAC], size_t channel, size_t j,
                              struct estimate *e)
{
    double n = (double)c->n_cell, square = mean[0][channel] * mean[1][channel], scale = 1.0 / ((n - 1.0) * square);
    double slope = 0.0, var = 0.0, shared = 0.0, contrast = e->mean[channel], relative[2];
    for (size_t s = 0; s < 2; s++) relative[s] = mean[s][3 + j] / mean[s][channel];
    for (size_t i = 0; i < c->n_cell; i++) {
        struct cell k = look_at(c, mean, i, channel, 3 + j);
        slope += scale * (k.slope[0] * k.value[1] + k.value[0] * k.slope[1]);
    }
    for (size_t i = 0; i < c->n_cell; i++) {
        struct cell k = look_at(c, mean, i, channel, 3 + j);
        for (size_t s = 0; s < 2; s++) {
            double whole = n * mean[s][channel], by_slope = scale * k.value[1 - s] - contrast / whole;
            double by_value = scale * k.slope[1 - s] - slope / whole - by_slope * (relative[0] + relative[1]) +
                              contrast * relative[s] / whole;
            var += by_slope * by_slope * k.slope_var[s] + by_value * by_value * k.var[s] +
                   2.0 * by_slope * by_value * k.covariance[s];
        }
        shared += scale * scale *
                  (k.var[0] * k.slope_var[1] + k.slope_var[0] * k.var[1] + 2.0 * k.covariance[0] * k.covariance[1]);
    }
    e->jac[j] = slope - contrast * (relative[0] + relative[1]);
    e->jac_var[j] = fmax(var - shared, 0.5 * fabs(shared));
}

bool contrast_reduce(const struct contrast_plan *c, struct estimate *e, size_t *bad_value)
{
    double mean[2][3 + N_JAC];
    memset(e, 0, sizeof *e);
    e->n_path = c->n_cell * 2 * c->n_half;
    crop_means(c, mean);
    for (size_t k = 0; k < 3 + c->n_jac; k++) {
        *bad_value = k;
        if (!isfinite(mean[0][k]) || !isfinite(mean[1][k])) return false;
    }
    for (size_t channel = 0; channel < 3; channel++) {
        if (!(mean[0][channel] > 0.0 && mean[1][channel] > 0.0)) {
            e->var[channel] = 1.0; /* a black crop has no contrast; a variance of 1 gives it no weight */
            continue;
        }
        reduce_channel(c, mean, channel, e);
        for (size_t p = 0; p < c->n_jac / 3; p++) reduce_derivative(c, mean, channel, channel * (c->n_jac / 3) + p, e);
    }
    return true;
}
