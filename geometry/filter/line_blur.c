/* The isotropic part of the line filter: a difference of two Gaussians, computed along the three axes in turn. */
#include "geometry/filter/line_blur.h"

#include "base/lanes.h"
#include "geometry/filter/line_filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_REACH = 60, LEAST_SLAB = 2, MOST_SLAB = 16 };

static const char NAME[] = "slices for directions";

struct kernel {
    int reach;
    float weight[2 * MAX_REACH + 1];
};

struct line_blur {
    const struct volume *v;
    struct kernel kernel[2]; /* of both Gaussians */
    float factor[2];         /* of them in the sum */
    float *half_done[2];     /* blurred in x and y, slice k at k % n_ring */
    size_t n_ring[2], half_done_end[2];
    float *slice;                    /* the window: slices first .. end - 1 */
    size_t first, end, n_most, slab; /* slab: slices that are blurred at a time */
    float *scratch;                  /* one slice per thread */
    size_t scratch_per_thread;
    int pass;    /* Gaussian that is applied now */
    size_t task; /* slice of its task 0 */
};

static double reach_of(double a) { return ceil(3.5 / sqrt(2.0 * a)); }

size_t line_filter_blur_reach(double s, double t) { return (size_t)reach_of(fmin(s, t)); }

/* Samples exp(-a x^2), scaled so that the sum equals the integral. Returns false when memory is out. */
static bool make_kernel(double a, struct kernel *k)
{
    double sum = 0.0;
    k->reach = (int)reach_of(a);
    if (k->reach > MAX_REACH) return false;
    for (int i = -k->reach; i <= k->reach; i++) sum += exp(-a * i * i);
    for (int i = -k->reach; i <= k->reach; i++)
        k->weight[i + k->reach] = (float)(exp(-a * i * i) * sqrt(M_PI / a) / sum);
    return true;
}

static ptrdiff_t clamp_index(ptrdiff_t i, size_t n) { return i < 0 ? 0 : i >= (ptrdiff_t)n ? (ptrdiff_t)n - 1 : i; }

static void add_scaled(float *restrict to, const float *restrict from, float w, size_t n)
{
    for (size_t i = 0; i < n; i++) to[i] += w * from[i];
}

/* Blurs rows along x with edge values repeated, then adds rows along y. */
static void blur_slice(void *context, size_t i_task, size_t i_thread)
{
    const struct line_blur *b = context;
    const size_t k = b->task + i_task, *n = b->v->n;
    scratch_keep_within(b->v->space);
    const struct kernel *q = &b->kernel[b->pass];
    float *padded = b->scratch + i_thread * b->scratch_per_thread, *rows = padded + n[0] + 2 * MAX_REACH;
    const float *in = b->v->density + k * n[0] * n[1];
    float *out = b->half_done[b->pass] + k % b->n_ring[b->pass] * n[0] * n[1];
    memset(rows, 0, n[0] * n[1] * sizeof *rows);
    memset(out, 0, n[0] * n[1] * sizeof *out);
    for (size_t j = 0; j < n[1]; j++) {
        const float *row = in + j * n[0];
        for (int i = 0; i < q->reach; i++) {
            padded[i] = row[0];
            padded[(size_t)q->reach + n[0] + (size_t)i] = row[n[0] - 1];
        }
        memcpy(padded + q->reach, row, n[0] * sizeof *row);
        for (int t = 0; t <= 2 * q->reach; t++) add_scaled(rows + j * n[0], padded + t, q->weight[t], n[0]);
    }
    for (size_t j = 0; j < n[1]; j++)
        for (int t = -q->reach; t <= q->reach; t++)
            add_scaled(out + j * n[0], rows + (size_t)clamp_index((ptrdiff_t)j + t, n[1]) * n[0],
                       q->weight[t + q->reach], n[0]);
}

static void blur_along_z(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct line_blur *b = context;
    const size_t k = b->task + i_task, n_slice = b->v->n[0] * b->v->n[1];
    scratch_keep_within(b->v->space);
    const struct kernel *q = &b->kernel[b->pass];
    float *out = b->slice + (k - b->first) * n_slice;
    if (b->pass == 0) memset(out, 0, n_slice * sizeof *out);
    enum { PART = 4096 }; /* this part stays in the cache for all taps */
    for (size_t from = 0; from < n_slice; from += PART) {
        size_t n = from + PART <= n_slice ? PART : n_slice - from;
        for (int t = -q->reach; t <= q->reach; t++) {
            size_t slice = (size_t)clamp_index((ptrdiff_t)k + t, b->v->n[2]);
            add_scaled(out + from, b->half_done[b->pass] + slice % b->n_ring[b->pass] * n_slice + from,
                       b->factor[b->pass] * q->weight[t + q->reach], n);
        }
    }
}

/* Computes slices from .. to - 1, at most a slab of them. */
static status blur_slab(struct line_blur *b, size_t from, size_t to, struct thread_pool *pool,
                        const struct progress *progress)
{
    status s = STATUS_OK;
    for (b->pass = 0; b->pass < 2 && s == STATUS_OK; b->pass++) {
        const size_t wanted = to + (size_t)b->kernel[b->pass].reach, n = b->v->n[2], end = wanted < n ? wanted : n;
        b->task = b->half_done_end[b->pass];
        if (end > b->task) s = thread_pool_run(pool, end - b->task, blur_slice, b, progress);
        b->half_done_end[b->pass] = end > b->task ? end : b->task;
        b->task = from;
        if (s == STATUS_OK) s = thread_pool_run(pool, to - from, blur_along_z, b, progress);
    }
    return s;
}

status line_blur_move(struct line_blur *b, size_t from, size_t to, struct thread_pool *pool,
                      const struct progress *progress)
{
    const size_t n_slice = b->v->n[0] * b->v->n[1];
    status s = STATUS_OK;
    if (from < b->first || from > b->end) { /* begin anew */
        b->first = b->end = from;
        for (int g = 0; g < 2; g++) {
            const size_t reach = (size_t)b->kernel[g].reach;
            b->half_done_end[g] = from > reach ? from - reach : 0;
        }
    }
    memmove(b->slice, b->slice + (from - b->first) * n_slice, (b->end - from) * n_slice * sizeof *b->slice);
    b->first = from;
    for (size_t k = b->end; k < to && s == STATUS_OK; k = b->end) {
        const size_t end = k + b->slab < to ? k + b->slab : to;
        s = blur_slab(b, k, end, pool, progress);
        b->end = end;
    }
    return s;
}

size_t line_blur_slab(const struct thread_pool *pool)
{
    const size_t n = thread_pool_n_thread(pool);
    return n < LEAST_SLAB ? LEAST_SLAB : n > MOST_SLAB ? MOST_SLAB : n;
}

struct volume line_blur_volume(const struct line_blur *b)
{
    struct volume l = *b->v;
    l.density = b->slice - b->first * l.n[0] * l.n[1];
    return l;
}

status line_blur_new(const struct volume *v, double s, double t, size_t n_most, struct thread_pool *pool,
                     struct line_blur **blur, struct error *err)
{
    const double width[2] = {s, t}, factor[2] = {2.0, -1.0};
    const size_t n_slice = v->n[0] * v->n[1];
    struct line_blur *b = calloc(1, sizeof *b);
    *blur = NULL;
    if (b == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    b->v = v;
    b->slab = line_blur_slab(pool);
    b->n_most = n_most < v->n[2] ? n_most : v->n[2];
    bool ok = s > 0.0 && t > 0.0;
    for (int g = 0; g < 2 && ok; g++) {
        ok = make_kernel(width[g], &b->kernel[g]);
        b->factor[g] = (float)(factor[g] * sqrt(width[g] / M_PI));
        b->n_ring[g] = b->slab + 2 * (size_t)b->kernel[g].reach;
        if (b->n_ring[g] > v->n[2]) b->n_ring[g] = v->n[2];
    }
    if (!ok) {
        free(b);
        return error_set(err, STATUS_INVALID, "cannot make the direction filter with s %g, t %g", s, t);
    }
    b->scratch_per_thread = n_slice + v->n[0] + 2 * MAX_REACH;
    b->scratch = malloc(thread_pool_n_thread(pool) * b->scratch_per_thread * sizeof *b->scratch);
    status st = b->scratch != NULL ? STATUS_OK : STATUS_NO_MEMORY;
    if (st != STATUS_OK) error_set(err, st, "cannot filter directions: out of memory");
    void *array = NULL;
    /* the last row is read beyond its end */
    if (st == STATUS_OK)
        st = scratch_new(v->space, (b->n_most * n_slice + LANES) * sizeof *b->slice, NAME, &array, err);
    b->slice = array;
    for (int g = 0; g < 2 && st == STATUS_OK; g++) {
        st = scratch_new(v->space, b->n_ring[g] * n_slice * sizeof *b->half_done[g], NAME, &array, err);
        b->half_done[g] = array;
    }
    if (st == STATUS_OK)
        *blur = b;
    else
        line_blur_free(b);
    return st;
}

void line_blur_free(struct line_blur *b)
{
    if (b == NULL) return;
    free(b->scratch);
    scratch_release(b->v->space, b->slice);
    for (int g = 0; g < 2; g++) scratch_release(b->v->space, b->half_done[g]);
    free(b);
}

status line_filter_blur(const struct volume *v, double s, double t, struct thread_pool *pool,
                        const struct progress *progress, struct volume *out, struct error *err)
{
    struct line_blur *b = NULL;
    const size_t n_slice = v->n[0] * v->n[1], slab = line_blur_slab(pool);
    const struct progress quiet = progress_silent(progress);
    *out = (struct volume){0};
    status st = line_blur_new(v, s, t, slab, pool, &b, err);
    if (st == STATUS_OK) st = volume_init_in(out, v->n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < v->n[2] && st == STATUS_OK; k += slab) {
        const size_t end = k + slab < v->n[2] ? k + slab : v->n[2];
        st = line_blur_move(b, k, end, pool, &quiet);
        if (st != STATUS_OK) error_set(err, st, "finding fiber directions was cancelled");
        memcpy(out->density + k * n_slice, b->slice, (end - k) * n_slice * sizeof *b->slice);
        progress_report(progress, (double)end / (double)v->n[2]);
    }
    line_blur_free(b);
    if (st != STATUS_OK) volume_release(out);
    return st;
}
