/* The isotropic part of the line filter: a difference of two Gaussians, computed along the three axes in turn. */
#include "geometry/filter/line_filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_REACH = 60, LEAST_SLAB = 16 /* slices of a slab in ample memory */ };

struct kernel {
    int reach;
    float weight[2 * MAX_REACH + 1];
};

struct blur_job {
    const struct volume *v;
    float *half_done, *out; /* half_done: blurred in x and y, slice k at k % n_ring; out: sum of both Gaussians */
    size_t n_ring, first;   /* first: slice of task 0 */
    struct kernel kernel;
    float factor; /* factor of this Gaussian in the sum */
    bool add;
    float *scratch; /* one slice per thread */
    size_t scratch_per_thread;
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
    const struct blur_job *job = context;
    size_t k = job->first + i_task;
    scratch_keep_within(job->v->space);
    const struct kernel *q = &job->kernel;
    const size_t *n = job->v->n;
    float *padded = job->scratch + i_thread * job->scratch_per_thread, *rows = padded + n[0] + 2 * MAX_REACH;
    const float *in = job->v->density + k * n[0] * n[1];
    float *out = job->half_done + k % job->n_ring * n[0] * n[1];
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
    const struct blur_job *job = context;
    size_t k = job->first + i_task;
    scratch_keep_within(job->v->space);
    const struct kernel *q = &job->kernel;
    size_t n_slice = job->v->n[0] * job->v->n[1];
    float *out = job->out + k * n_slice;
    if (!job->add) memset(out, 0, n_slice * sizeof *out);
    enum { PART = 4096 }; /* this part stays in the cache for all taps */
    for (size_t from = 0; from < n_slice; from += PART) {
        size_t n = from + PART <= n_slice ? PART : n_slice - from;
        for (int t = -q->reach; t <= q->reach; t++) {
            size_t slice = (size_t)clamp_index((ptrdiff_t)k + t, job->v->n[2]);
            add_scaled(out + from, job->half_done + slice % job->n_ring * n_slice + from,
                       job->factor * q->weight[t + q->reach], n);
        }
    }
}

/* Applies one Gaussian in slabs. A slab has as many slices as the buffer holds beside those that the kernel reaches. */
static status blur_slabs(struct blur_job *job, size_t n_slab, struct thread_pool *pool, const struct progress *progress)
{
    size_t n = job->v->n[2], reach = (size_t)job->kernel.reach, ready = 0;
    const struct progress quiet = progress_silent(progress);
    status s = STATUS_OK;
    for (size_t k = 0; k < n && s == STATUS_OK; k += n_slab) {
        size_t end = k + n_slab < n ? k + n_slab : n, wanted = end + reach < n ? end + reach : n;
        job->first = ready;
        s = thread_pool_run(pool, wanted - ready, blur_slice, job, &quiet);
        ready = wanted;
        job->first = k;
        if (s == STATUS_OK) s = thread_pool_run(pool, end - k, blur_along_z, job, &quiet);
        progress_report(progress, (job->add ? 0.5 : 0.0) + 0.5 * (double)end / (double)n);
    }
    return s;
}

status line_filter_blur(const struct volume *v, double s, double t, struct thread_pool *pool,
                        const struct progress *progress, struct volume *out, struct error *err)
{
    struct blur_job job = {.v = v};
    size_t n_slice = v->n[0] * v->n[1], n_slab = scratch_buffer_bytes(v->space) / (n_slice * sizeof(float));
    *out = (struct volume){0};
    if (!(s > 0.0) || !(t > 0.0) || !make_kernel(fmax(s, t), &job.kernel) || !make_kernel(fmin(s, t), &job.kernel))
        return error_set(err, STATUS_INVALID, "cannot make the direction filter with s %g, t %g", s, t);
    if (n_slab < 4) n_slab = 4;
    const size_t enough = 2 * thread_pool_n_thread(pool); /* larger slabs take memory and no less time */
    if (n_slab > LEAST_SLAB && n_slab > enough) n_slab = enough > LEAST_SLAB ? enough : LEAST_SLAB;
    if (n_slab > v->n[2]) n_slab = v->n[2];
    status st = volume_init_in(out, v->n, v->voxel_size_m, v->space, err);
    if (st != STATUS_OK) return st;
    job.out = out->density;
    job.n_ring = n_slab + 2 * (size_t)job.kernel.reach < v->n[2] ? n_slab + 2 * (size_t)job.kernel.reach
                                                                 : v->n[2]; /* of the wider Gaussian */
    job.scratch_per_thread = n_slice + v->n[0] + 2 * MAX_REACH;
    job.scratch = malloc(thread_pool_n_thread(pool) * job.scratch_per_thread * sizeof *job.scratch);
    job.half_done = malloc(job.n_ring * n_slice * sizeof *job.half_done);
    if (job.scratch == NULL || job.half_done == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot filter directions: out of memory");
    const double width[2] = {s, t}, factor[2] = {2.0, -1.0};
    for (int g = 0; g < 2 && st == STATUS_OK; g++) {
        make_kernel(width[g], &job.kernel);
        job.factor = (float)(factor[g] * sqrt(width[g] / M_PI));
        job.add = g > 0;
        st = blur_slabs(&job, n_slab, pool, progress);
        if (st != STATUS_OK) error_set(err, st, "finding fiber directions was cancelled");
    }
    free(job.scratch);
    free(job.half_done);
    if (st != STATUS_OK) volume_release(out);
    return st;
}
