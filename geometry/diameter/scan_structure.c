#include "geometry/diameter/scan_structure.h"

#include "geometry/diameter/scale_space.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { EDGE = SCALE_EDGE, N_CELL = EDGE * EDGE * EDGE, N_LEVEL = 6, MAX_BRICK = 128, AT_ONCE = 4, LEAST_EDGE = 16 };

/* Sums of the third and fourth power of the autocorrelation (1 - 4/3 u + 4/15 u^2) exp(-u), u = r^2 / 4 s^2, over all
 * voxels, divided by s^3. */
static const double CUBES = 2.002, FOURTHS = 1.394;

/* Noise of single voxels that is not Gaussian has responses whose moments fall with s^(3/2) and s^3: white noise of
 * three photons a voxel has a skewness of 0.25 / s^(3/2), and white noise with exponential tails an excess kurtosis of
 * 0.8 / s^3. Noise that is stronger towards a side of the scan has an excess kurtosis of up to 0.4 at all scales. */
static const double VOXEL_SKEWNESS = 0.3, VOXEL_KURTOSIS = 0.9, UNEVEN_KURTOSIS = 0.4;

struct brick {
    size_t from[3], n[3];
    double density; /* sum over every third voxel along each axis */
};

/* Moments of the response in a brick at one scale. */
struct moments {
    double n, skewness, kurtosis; /* n: voxels; excess kurtosis */
    double blur3;                 /* s^3 */
};

struct job {
    const struct volume *v;
    const struct brick *brick;
    struct moments (*moments)[N_LEVEL]; /* of each brick; n is 0 where nothing is said */
    float *scratch;                     /* two bricks per thread */
    size_t first;                       /* brick of the first task */
};

static double level_sigma(int level) { return pow(2.0, 0.5 * level); }

/* Loads the densities of a brick less their mean, which would cost the responses their last digits. Returns false if
 * some are not finite. */
static bool load_brick(const struct volume *v, const struct brick *b, float *a)
{
    const size_t n = b->n[0] * b->n[1] * b->n[2];
    double sum = 0.0;
    scratch_keep_within(v->space);
    for (size_t k = 0; k < b->n[2]; k++)
        for (size_t j = 0; j < b->n[1]; j++)
            memcpy(a + (k * b->n[1] + j) * b->n[0],
                   v->density + volume_index(v->n, b->from[0], b->from[1] + j, b->from[2] + k), b->n[0] * sizeof *a);
    for (size_t i = 0; i < n; i++) sum += (double)a[i];
    const double mean = sum / (double)n;
    for (size_t i = 0; i < n; i++) a[i] = (float)((double)a[i] - mean);
    return isfinite(sum);
}

/* Moments of minus the Laplacian of a within `margin` of no face. r: scratch of the same size. */
static struct moments measure_response(const float *a, float *r, const size_t n[3], size_t margin)
{
    const ptrdiff_t sy = (ptrdiff_t)n[0], sz = (ptrdiff_t)(n[0] * n[1]);
    double count = 0.0, sum = 0.0, square = 0.0, third = 0.0, fourth = 0.0, gradient = 0.0;
    for (size_t k = margin; k + margin < n[2]; k++)
        for (size_t j = margin; j + margin < n[1]; j++)
            for (size_t i = margin; i + margin < n[0]; i++, count += 1.0) {
                const size_t at = (k * n[1] + j) * n[0] + i;
                r[at] = scale_minus_laplacian(a + at, sy, sz);
                sum += (double)r[at];
            }
    const double mean = sum / count;
    for (size_t k = margin; k + margin < n[2]; k++)
        for (size_t j = margin; j + margin < n[1]; j++)
            for (size_t i = margin; i + margin < n[0]; i++) {
                const float *p = r + (k * n[1] + j) * n[0] + i;
                const double x = (double)p[0] - mean;
                const ptrdiff_t before[3] = {i > margin ? 1 : 0, j > margin ? sy : 0, k > margin ? sz : 0};
                square += x * x;
                third += x * x * x;
                fourth += x * x * x * x;
                for (int c = 0; c < 3; c++) gradient += (double)((p[0] - p[-before[c]]) * (p[0] - p[-before[c]]));
            }
    const double variance = square / count;
    if (!(variance > 0.0) || !(gradient > 0.0)) return (struct moments){0};
    return (struct moments){count, third / count / pow(variance, 1.5), fourth / count / (variance * variance) - 3.0,
                            pow(3.5 * square / gradient, 1.5)};
}

static void measure_brick(void *context, size_t i_task, size_t i_thread)
{
    struct job *job = context;
    const struct brick *b = &job->brick[job->first + i_task];
    float *a = job->scratch + i_thread * 2 * N_CELL, *tmp = a + N_CELL;
    double done = 0.0;
    if (!load_brick(job->v, b, a)) return;
    for (int l = 0; l < N_LEVEL; l++) {
        const double sigma = level_sigma(l);
        size_t margin = 1 + (size_t)(2.0 * sigma);
        for (int c = 0; c < 3; c++) margin = margin > b->n[c] / 4 ? b->n[c] / 4 : margin;
        scale_blur(a, tmp, b->n, sqrt(sigma * sigma - done * done));
        job->moments[job->first + i_task][l] = measure_response(a, tmp, b->n, margin);
        done = sigma;
    }
}

static int denser_first(const void *a, const void *b)
{
    const struct brick *x = a, *y = b;
    if (x->density != y->density) return x->density > y->density ? -1 : 1;
    for (int i = 2; i >= 0; i--)
        if (x->from[i] != y->from[i]) return x->from[i] < y->from[i] ? -1 : 1;
    return 0;
}

/* Sorts the bricks of a lattice over the volume by their density. Of more than MAX_BRICK some are left out evenly, and
 * the densest one stays. */
static status list_bricks(const struct volume *v, struct brick **brick, size_t *n, struct error *err)
{
    size_t n_cell[3];
    for (int a = 0; a < 3; a++) n_cell[a] = (v->n[a] + EDGE - 1) / EDGE;
    *n = volume_n_voxel(n_cell);
    struct brick *all = calloc(*n, sizeof *all);
    if (all == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for structure in the scan: out of memory");
    for (size_t c = 0; c < *n; c++) {
        const size_t cell[3] = {c % n_cell[0], c / n_cell[0] % n_cell[1], c / (n_cell[0] * n_cell[1])};
        for (int a = 0; a < 3; a++) {
            all[c].n[a] = v->n[a] < EDGE ? v->n[a] : EDGE;
            all[c].from[a] = n_cell[a] == 1 ? 0 : cell[a] * (v->n[a] - all[c].n[a]) / (n_cell[a] - 1);
        }
        scratch_keep_within(v->space);
        for (size_t k = 0; k < all[c].n[2]; k += 3)
            for (size_t j = 0; j < all[c].n[1]; j += 3) {
                const size_t *from = all[c].from;
                const float *row = v->density + volume_index(v->n, from[0], from[1] + j, from[2] + k);
                for (size_t i = 0; i < all[c].n[0]; i += 3) all[c].density += (double)row[i];
            }
    }
    qsort(all, *n, sizeof *all, denser_first);
    const size_t n_all = *n;
    if (n_all > MAX_BRICK) {
        for (size_t i = 0; i < MAX_BRICK; i++) all[i] = all[i * n_all / MAX_BRICK];
        *n = MAX_BRICK;
    }
    *brick = all;
    return STATUS_OK;
}

static double larger(double a, double b) { return a > b ? a : b; }

/* Deviation of moments from noise over their standard errors. n: number of voxels, each counted once. */
static double deviation_of(const struct moments *m, double n)
{
    if (!(n > 0.0)) return 0.0;
    const double skewness = fabs(m->skewness) - VOXEL_SKEWNESS / sqrt(m->blur3);
    const double kurtosis = fabs(m->kurtosis) - UNEVEN_KURTOSIS - VOXEL_KURTOSIS / m->blur3;
    return larger(skewness / sqrt(6.0 * (1.0 + CUBES * m->blur3) / n),
                  kurtosis / sqrt(24.0 * (1.0 + FOURTHS * m->blur3) / n));
}

/* Largest deviation of n_brick bricks and of all of them together. *n_known: bricks that say something. */
static double largest_deviation(const struct job *job, size_t n_brick, size_t *n_known)
{
    double largest = 0.0;
    for (int l = 0; l < N_LEVEL; l++) {
        struct moments all = {0};
        *n_known = 0;
        for (size_t b = 0; b < n_brick; b++) {
            const struct moments *m = &job->moments[b][l];
            if (!(m->n > 0.0)) continue;
            ++*n_known;
            largest = larger(largest, deviation_of(m, m->n));
            all.n += m->n;
            all.skewness += m->n * m->skewness;
            all.kurtosis += m->n * m->kurtosis;
            all.blur3 += m->n * m->blur3;
        }
        if (*n_known == 0) return INFINITY;
        all.skewness /= all.n;
        all.kurtosis /= all.n;
        all.blur3 /= all.n;
        largest = larger(largest, deviation_of(&all, fmin(all.n, (double)volume_n_voxel(job->v->n))));
    }
    return largest;
}

status scan_structure_measure(const struct volume *v, struct thread_pool *pool, double *deviation, struct error *err)
{
    struct brick *brick = NULL;
    struct job job = {.v = v};
    size_t n = 0, n_known = 0;
    *deviation = INFINITY;
    for (int a = 0; a < 3; a++)
        if (v->n[a] < LEAST_EDGE) return STATUS_OK;
    status s = list_bricks(v, &brick, &n, err);
    if (s != STATUS_OK) return s;
    job.brick = brick;
    job.moments = calloc(n, sizeof *job.moments);
    job.scratch = malloc(thread_pool_n_thread(pool) * 2 * N_CELL * sizeof *job.scratch);
    if (job.moments == NULL || job.scratch == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot look for structure in the scan: out of memory");
    while (s == STATUS_OK && job.first < n && (n_known == 0 || *deviation < SCAN_STRUCTURE_LEAST)) {
        const size_t n_now = n - job.first < AT_ONCE ? n - job.first : AT_ONCE;
        s = thread_pool_run(pool, n_now, measure_brick, &job, NULL);
        job.first += n_now;
        *deviation = largest_deviation(&job, job.first, &n_known);
    }
    if (s == STATUS_CANCELLED) error_set(err, s, "looking for structure in the scan was cancelled");
    free(job.moments);
    free(job.scratch);
    free(brick);
    return s;
}
