#include "geometry/volume/noise_smoothing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_REACH = 4, BATCH = 4 }; /* voxels to each side; slices that are blurred at once */
/* Noise that needs no smoothing: finding centers, growing and joining work as well with it as without any. */
static const double WEAK = 0.2;
/* Bounds of the Gaussian: below the least it does next to nothing, and the most is about the blur of a sharp scan.
 * Fibers of FINEST_VOXEL need all of the scan's resolution. */
static const double LEAST_SD_VOXEL = 0.3, MOST_SD_VOXEL = 0.7, FINEST_VOXEL = 4.0, BEYOND_FINEST = 0.25;

/* Data that the threads share. Slice k, blurred along x and y, is at k % n_held of `held`. */
struct smoothing {
    struct volume *v;
    float kernel[2 * MAX_REACH + 1];
    ptrdiff_t reach;
    float *held, *slice; /* slice: one per thread */
    size_t n_held, first;
};

static size_t slice_voxels(const struct smoothing *s) { return s->v->n[0] * s->v->n[1]; }

static void find_kernel(double sd, struct smoothing *s)
{
    double sum = 0.0;
    s->reach = (ptrdiff_t)fmin(MAX_REACH, ceil(4.0 * sd));
    for (ptrdiff_t m = -s->reach; m <= s->reach; m++) sum += exp(-0.5 * (double)(m * m) / (sd * sd));
    for (ptrdiff_t m = -s->reach; m <= s->reach; m++)
        s->kernel[m + s->reach] = (float)(exp(-0.5 * (double)(m * m) / (sd * sd)) / sum);
}

static size_t within(ptrdiff_t at, size_t n) { return at < 0 ? 0 : at >= (ptrdiff_t)n ? n - 1 : (size_t)at; }

static void add_scaled(float *restrict to, const float *restrict from, float weight, size_t n)
{
    for (size_t i = 0; i < n; i++) to[i] += weight * from[i];
}

/* Blurs a row along x. */
static void blur_row(const struct smoothing *s, const float *from, float *to, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        float sum = 0.0f;
        for (ptrdiff_t m = -s->reach; m <= s->reach; m++)
            sum += s->kernel[m + s->reach] * from[within((ptrdiff_t)i + m, n)];
        to[i] = sum;
    }
}

static void blur_slice(void *context, size_t i_task, size_t i_thread)
{
    const struct smoothing *s = context;
    const size_t k = s->first + i_task, *n = s->v->n;
    float *row = s->slice + i_thread * slice_voxels(s), *to = s->held + k % s->n_held * slice_voxels(s);
    scratch_keep_within(s->v->space);
    for (size_t j = 0; j < n[1]; j++) blur_row(s, s->v->density + volume_index(n, 0, j, k), row + j * n[0], n[0]);
    memset(to, 0, slice_voxels(s) * sizeof *to);
    for (size_t j = 0; j < n[1]; j++)
        for (ptrdiff_t m = -s->reach; m <= s->reach; m++)
            add_scaled(to + j * n[0], row + within((ptrdiff_t)j + m, n[1]) * n[0], s->kernel[m + s->reach], n[0]);
}

/* Writes a slice, of whose neighbours `reach` on both sides are held. */
static void write_slice(void *context, size_t i_task, size_t i_thread)
{
    const struct smoothing *s = context;
    const size_t k = s->first + i_task, n = slice_voxels(s);
    float *to = s->v->density + k * n;
    (void)i_thread;
    memset(to, 0, n * sizeof *to);
    for (ptrdiff_t m = -s->reach; m <= s->reach; m++)
        add_scaled(to, s->held + within((ptrdiff_t)k + m, s->v->n[2]) % s->n_held * n, s->kernel[m + s->reach], n);
}

static status blur_batches(struct smoothing *s, struct thread_pool *pool)
{
    const size_t n = s->v->n[2], reach = (size_t)s->reach;
    size_t taken = 0, written = 0;
    status st = STATUS_OK;
    while (written < n && st == STATUS_OK) {
        const size_t more = n - taken < BATCH ? n - taken : BATCH;
        s->first = taken;
        st = thread_pool_run(pool, more, blur_slice, s, NULL);
        taken += more;
        const size_t ready = taken == n ? n : taken > reach ? taken - reach : 0;
        s->first = written;
        if (st == STATUS_OK) st = thread_pool_run(pool, ready - written, write_slice, s, NULL);
        written = ready;
    }
    return st;
}

status volume_smooth_noise(struct volume *v, double sd_voxel, struct thread_pool *pool, struct error *err)
{
    struct smoothing s = {.v = v};
    find_kernel(sd_voxel, &s);
    s.n_held = BATCH + 2 * (size_t)s.reach;
    s.held = malloc(s.n_held * slice_voxels(&s) * sizeof *s.held);
    s.slice = malloc(thread_pool_n_thread(pool) * slice_voxels(&s) * sizeof *s.slice);
    status st = STATUS_OK;
    if (s.held == NULL || s.slice == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot smooth the noise of the scan: out of memory");
    else if ((st = blur_batches(&s, pool)) != STATUS_OK)
        error_set(err, st, "smoothing the noise of the scan was cancelled");
    free(s.held);
    free(s.slice);
    return st;
}

/* Standard deviation of white noise of 1 after the Gaussian. */
static double white_noise_after(double sd)
{
    struct smoothing s;
    double square = 0.0;
    find_kernel(sd, &s);
    for (ptrdiff_t m = 0; m <= 2 * s.reach; m++) square += (double)s.kernel[m] * (double)s.kernel[m];
    return sqrt(square * square * square);
}

double noise_smoothing_sd(double scan_sd, double diameter_voxel)
{
    const double most = fmin(MOST_SD_VOXEL, BEYOND_FINEST * (diameter_voxel - FINEST_VOXEL));
    double low = LEAST_SD_VOXEL, high = most;
    if (!(scan_sd > WEAK) || !(most > LEAST_SD_VOXEL)) return 0.0;
    for (int i = 0; i < 30; i++) {
        const double sd = 0.5 * (low + high);
        *(scan_sd * white_noise_after(sd) > WEAK ? &low : &high) = sd;
    }
    return high;
}
