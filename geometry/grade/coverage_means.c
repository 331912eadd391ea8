#include "geometry/grade/coverage_means.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* BINS: of a histogram of means, from LOWEST on. LEAST_COUNT: of the means of a block with a background of its own. */
enum { BLOCK_EDGE = 16, MOST_BLOCKS = 64, BINS = 256, LEAST_COUNT = 100, N_WORK = 4 };
static const double LOWEST = -0.25, BIN = 0.005;
/* Factor by which the correlated noise of scanners exceeds white noise in a mean. */
static const double CORRELATED = 2.0;
/* Share of a cube that must count for a mean, and distance from fibers of the means that the background comes from. */
static const float LEAST_WEIGHT = 0.3f;
static const double FAR_VOXEL = 3.0;
/* Quantiles of the means in void that give the background and its noise: in a normal distribution they lie 0.52 and
 * 1.64 standard deviations below the mean. Material that no fiber explains lies above both. */
static const double QUANTILE[2] = {0.05, 0.3}, BELOW[2] = {1.645, 0.524};

status coverage_means_init(struct coverage_means *m, const struct coverage_input *in, const uint8_t *code,
                           struct thread_pool *pool, struct error *err)
{
    const size_t n_thread = pool != NULL ? thread_pool_n_thread(pool) : 1;
    const double blur = fmax(0.5, in->blur_voxel);
    *m = (struct coverage_means){.v = in->v, .code = code, .noise_sd = in->noise_sd};
    m->slice_floats = in->v->n[0] * in->v->n[1];
    m->reach = in->diameter_voxel < 6.0 ? 1 : in->diameter_voxel < 10.0 ? 2 : 3;
    for (int c = 0; c < LINE_FAR; c++)
        m->rim[c] = (float)(0.5 * erfc(line_distance_voxel((uint8_t)c) / (sqrt(2.0) * blur)));
    m->work = malloc(n_thread * N_WORK * m->slice_floats * sizeof *m->work);
    return m->work != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
}

void coverage_means_release(struct coverage_means *m)
{
    free(m->work);
    m->work = NULL;
}

static bool has_weight(uint8_t code)
{
    return code != LINE_UNKNOWN && code >= LINE_OUTSIDE + COVERAGE_APART_VOXEL * LINE_PER_VOXEL;
}

/* Sums of densities and weights over 2 reach + 1 slices. */
static void sum_along_z(const struct coverage_means *m, size_t k, float *density, float *weight)
{
    const size_t from = k > m->reach ? k - m->reach : 0;
    const size_t end = k + m->reach + 1 < m->v->n[2] ? k + m->reach + 1 : m->v->n[2];
    memset(density, 0, m->slice_floats * sizeof *density);
    memset(weight, 0, m->slice_floats * sizeof *weight);
    for (size_t z = from; z < end; z++) {
        const float *v = m->v->density + z * m->slice_floats;
        const uint8_t *code = m->code + z * m->slice_floats;
        for (size_t i = 0; i < m->slice_floats; i++) {
            if (!has_weight(code[i])) continue;
            density[i] += v[i] - m->rim[code[i]];
            weight[i] += 1.0f;
        }
    }
}

/* Sums over 2 reach + 1 places of n_line lines, `apart` apart, of n values each, `step` apart. */
static void sum_along(const float *in, float *out, size_t reach, const size_t line[4])
{
    const size_t n = line[0], step = line[1], n_line = line[2], apart = line[3];
    for (size_t l = 0; l < n_line; l++)
        for (size_t i = 0; i < n; i++) {
            const size_t from = i > reach ? i - reach : 0, last = i + reach < n ? i + reach : n - 1;
            float sum = 0.0f;
            for (size_t at = from; at <= last; at++) sum += in[l * apart + at * step];
            out[l * apart + i * step] = sum;
        }
}

const float *coverage_means_of_slice(const struct coverage_means *m, size_t k, size_t i_thread)
{
    float *work = m->work + i_thread * N_WORK * m->slice_floats;
    float *density = work, *weight = work + m->slice_floats;
    float *passed[2] = {work + 2 * m->slice_floats, work + 3 * m->slice_floats};
    const size_t *n = m->v->n, along_x[4] = {n[0], 1, n[1], n[0]}, along_y[4] = {n[1], n[0], n[0], 1};
    const uint8_t *code = m->code + k * m->slice_floats;
    const float edge = (float)(2 * m->reach + 1), least = LEAST_WEIGHT * edge * edge * edge;
    sum_along_z(m, k, density, weight);
    sum_along(density, passed[0], m->reach, along_x);
    sum_along(passed[0], density, m->reach, along_y);
    sum_along(weight, passed[1], m->reach, along_x);
    sum_along(passed[1], weight, m->reach, along_y);
    for (size_t i = 0; i < m->slice_floats; i++)
        density[i] = has_weight(code[i]) && weight[i] >= least ? density[i] / weight[i] : NAN;
    return density;
}

/* ---- background ---- */

struct background_job {
    const struct coverage_means *m;
    const struct coverage_background *b;
    atomic_uint *count; /* BINS for each block */
};

static void count_means(void *context, size_t k, size_t i_thread)
{
    struct background_job *j = context;
    const size_t *n = j->m->v->n;
    const float *mean = coverage_means_of_slice(j->m, k, i_thread);
    for (size_t row = 0; row < n[1]; row++)
        for (size_t i = 0; i < n[0]; i++) {
            const float x = mean[row * n[0] + i];
            const uint8_t code = j->m->code[k * j->m->slice_floats + row * n[0] + i];
            if (isnan(x) || line_distance_voxel(code) < FAR_VOXEL) continue;
            const size_t block = row / j->b->edge * j->b->n[0] + i / j->b->edge;
            const size_t bin = (size_t)fmin(fmax(((double)x - LOWEST) / BIN, 0.0), BINS - 1.0);
            atomic_fetch_add_explicit(&j->count[block * BINS + bin], 1, memory_order_relaxed);
        }
    scratch_keep_within(j->m->v->space);
}

static double quantile(const atomic_uint *count, double n, double share)
{
    double below = 0.0;
    for (int bin = 0; bin < BINS; bin++) {
        const double here = (double)count[bin];
        if (here > 0.0 && below + here >= share * n) return LOWEST + BIN * (bin + (share * n - below) / here);
        below += here;
    }
    return LOWEST + BIN * BINS;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *x, size_t n)
{
    qsort(x, n, sizeof *x, ascending);
    return n > 0 ? x[n / 2] : 0.0;
}

/* Level and noise in a scan without void, by the noise of single voxels, whose values below 0 were clamped. */
static void expect_levels(const struct coverage_means *m, double *level, double *noise_sd)
{
    const double edge = (double)(2 * m->reach + 1);
    *level = m->noise_sd / sqrt(2.0 * M_PI);
    *noise_sd = 0.58 * m->noise_sd * CORRELATED / sqrt(edge * edge * edge);
}

/* Level of each block, and the noise: the median over blocks. Blocks with too little void take the median level. */
static status take_levels(const struct coverage_means *m, struct coverage_background *b, const atomic_uint *count,
                          struct error *err)
{
    const size_t n_block = b->n[0] * b->n[1];
    double *of_block = malloc(2 * n_block * sizeof *of_block);
    size_t n = 0;
    if (of_block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    double *noise = of_block + n_block;
    for (size_t block = 0; block < n_block; block++) {
        const atomic_uint *of = count + block * BINS;
        double all = 0.0;
        for (int bin = 0; bin < BINS; bin++) all += (double)of[bin];
        b->level[block] = NAN;
        if (all < LEAST_COUNT) continue;
        const double low = quantile(of, all, QUANTILE[0]), high = quantile(of, all, QUANTILE[1]);
        noise[n] = (high - low) / (BELOW[0] - BELOW[1]);
        b->level[block] = of_block[n++] = high + BELOW[1] * (high - low) / (BELOW[0] - BELOW[1]);
    }
    b->noise_sd = median(noise, n);
    double typical = median(of_block, n);
    if (n == 0) expect_levels(m, &typical, &b->noise_sd);
    for (size_t block = 0; block < n_block; block++)
        if (isnan(b->level[block])) b->level[block] = typical;
    free(of_block);
    return STATUS_OK;
}

status coverage_background_measure(const struct coverage_means *m, struct thread_pool *pool,
                                   struct coverage_background *b, struct error *err)
{
    const size_t *n = m->v->n, larger = n[0] > n[1] ? n[0] : n[1];
    b->edge = larger / MOST_BLOCKS > BLOCK_EDGE ? larger / MOST_BLOCKS : BLOCK_EDGE;
    for (int a = 0; a < 2; a++) b->n[a] = (n[a] + b->edge - 1) / b->edge;
    const size_t n_block = b->n[0] * b->n[1];
    struct background_job j = {m, b, calloc(n_block * BINS, sizeof *j.count)};
    b->level = malloc(n_block * sizeof *b->level);
    status s = b->level != NULL && j.count != NULL
                   ? STATUS_OK
                   : error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, n[2], count_means, &j, NULL);
        if (s != STATUS_OK) error_set(err, s, "grading the scan was cancelled");
    }
    if (s == STATUS_OK) s = take_levels(m, b, j.count, err);
    free(j.count);
    return s;
}

void coverage_background_release(struct coverage_background *b)
{
    free(b->level);
    b->level = NULL;
}

double coverage_background_at(const struct coverage_background *b, size_t i, size_t j)
{
    const size_t at[2] = {i, j};
    size_t low[2], high[2];
    double part[2];
    for (int a = 0; a < 2; a++) {
        const double x = fmax(0.0, ((double)at[a] + 0.5) / (double)b->edge - 0.5);
        low[a] = (size_t)x < b->n[a] ? (size_t)x : b->n[a] - 1;
        high[a] = low[a] + 1 < b->n[a] ? low[a] + 1 : low[a];
        part[a] = x - (double)low[a];
    }
    const double *of_low = b->level + low[1] * b->n[0], *of_high = b->level + high[1] * b->n[0];
    const double below = of_low[low[0]] + part[0] * (of_low[high[0]] - of_low[low[0]]);
    const double above = of_high[low[0]] + part[0] * (of_high[high[0]] - of_high[low[0]]);
    return below + part[1] * (above - below);
}
