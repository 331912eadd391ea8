#include "geometry/volume/volume_rescale.h"

#include "geometry/volume/kept_directions.h"
#include "geometry/volume/volume_align.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct mean_job {
    const struct volume *in;
    struct volume *out;
    double edge;
    double *row; /* per thread: sums of a row of `in` */
};

/* Voxels from .. to - 1 of an axis of n that voxel i of `edge` covers, and how much of them lies in it. */
struct cover {
    size_t from, to;
    double start, end;
};

static struct cover cover_of(size_t i, double edge, size_t n)
{
    struct cover c = {.start = (double)i * edge, .end = fmin((double)(i + 1) * edge, (double)n)};
    c.from = (size_t)c.start;
    c.to = (size_t)ceil(c.end);
    return c;
}

static double share(const struct cover *c, size_t at)
{
    return fmin(c->end, (double)at + 1.0) - fmax(c->start, (double)at);
}

/* Adds the rows that row (j, k) of `out` covers. */
static void sum_rows(const struct mean_job *job, const struct cover *y, const struct cover *z, double *sum)
{
    const size_t *n = job->in->n;
    memset(sum, 0, n[0] * sizeof *sum);
    for (size_t k = z->from; k < z->to; k++)
        for (size_t j = y->from; j < y->to; j++) {
            const float *row = job->in->density + volume_index(n, 0, j, k);
            const double weight = share(y, j) * share(z, k);
            for (size_t i = 0; i < n[0]; i++) sum[i] += weight * (double)row[i];
        }
}

static void mean_slice(void *context, size_t k, size_t i_thread)
{
    struct mean_job *job = context;
    const size_t *n = job->in->n, *m = job->out->n;
    double *sum = job->row + i_thread * n[0];
    const struct cover z = cover_of(k, job->edge, n[2]);
    for (size_t j = 0; j < m[1]; j++) {
        const struct cover y = cover_of(j, job->edge, n[1]);
        scratch_keep_within(job->in->space);
        sum_rows(job, &y, &z, sum);
        for (size_t i = 0; i < m[0]; i++) {
            const struct cover x = cover_of(i, job->edge, n[0]);
            double mean = 0.0;
            for (size_t at = x.from; at < x.to; at++) mean += share(&x, at) * sum[at];
            mean /= (x.end - x.start) * (y.end - y.start) * (z.end - z.start);
            job->out->density[volume_index(m, i, j, k)] = (float)mean;
        }
    }
}

/* Fills `out`, whose array is there. */
static status coarsen(const struct volume *v, double edge, struct thread_pool *pool, const struct progress *progress,
                      struct volume *out, struct error *err)
{
    struct mean_job job = {.in = v, .out = out, .edge = edge};
    job.row = malloc(thread_pool_n_thread(pool) * v->n[0] * sizeof *job.row);
    if (job.row == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make larger voxels: out of memory");
    status s = thread_pool_run(pool, out->n[2], mean_slice, &job, progress);
    free(job.row);
    return s == STATUS_OK ? s : error_set(err, s, "making larger voxels was cancelled");
}

static status rescale(const struct volume *v, double edge, struct thread_pool *pool, const struct progress *progress,
                      struct volume *out, struct error *err)
{
    static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    if (edge >= 1.0) return coarsen(v, edge, pool, progress, out, err);
    return volume_resample_to(v, identity, (const size_t[3]){0, 0, 0}, pool, progress, out, err);
}

status volume_rescale(const struct volume *v, double edge, struct thread_pool *pool, const struct progress *progress,
                      struct volume *out, struct error *err)
{
    size_t n[3];
    double size_m[3];
    *out = (struct volume){0};
    for (int a = 0; a < 3; a++) {
        n[a] = (size_t)ceil((double)v->n[a] / edge - 1e-9);
        size_m[a] = edge * v->voxel_size_m[edge < 1.0 ? 0 : a];
    }
    if (edge < 1.0) volume_resampled_shape(v->n, v->voxel_size_m, size_m[0], n);
    status s = volume_init_in(out, n, size_m, v->space, err);
    if (s == STATUS_OK) s = rescale(v, edge, pool, progress, out, err);
    if (s != STATUS_OK) volume_release(out);
    return s;
}

status volume_rescale_again(const struct volume *v, double edge, struct thread_pool *pool,
                            const struct progress *progress, struct volume *out, struct error *err)
{
    return rescale(v, edge, pool, progress, out, err);
}

struct direction_job {
    const struct direction_volume *from;
    const struct volume *v;
    struct direction_volume *out;
    float eps_d;
    size_t *n_material, *n_kept; /* per slice */
};

/* Voxel of an axis of `from` that holds the centre of voxel i of `out`. */
static size_t holder(const struct direction_job *job, int axis, size_t i)
{
    double at = ((double)i + 0.5) * job->out->voxel_size_m[axis] / job->from->voxel_size_m[axis];
    size_t last = job->from->n[axis] - 1;
    return at >= (double)last ? last : (size_t)at;
}

/* First and last + 1 voxel of an axis of `from` whose centre lies in voxel i of `out`. */
static void centres_in(const struct direction_job *job, int axis, size_t i, size_t *from, size_t *to)
{
    double ratio = job->out->voxel_size_m[axis] / job->from->voxel_size_m[axis], n = (double)job->from->n[axis];
    *from = (size_t)ceil(fmin(n, fmax(0.0, (double)i * ratio - 0.5)));
    *to = (size_t)ceil(fmin(n, fmax(0.0, (double)(i + 1) * ratio - 0.5)));
}

/* Voxel of `from` that voxel x of `out` takes its direction from: the one that holds its centre, or if that is empty
 * the first whose centre it holds. SIZE_MAX: all are empty. */
static size_t source_of(const struct direction_job *job, const size_t x[3])
{
    const struct direction_volume *from = job->from;
    size_t at = volume_index(from->n, holder(job, 0, x[0]), holder(job, 1, x[1]), holder(job, 2, x[2])), lo[3], hi[3];
    if (direction_volume_is_kept(from, at)) return at;
    for (int a = 0; a < 3; a++) centres_in(job, a, x[a], &lo[a], &hi[a]);
    for (size_t k = lo[2]; k < hi[2]; k++)
        for (size_t j = lo[1]; j < hi[1]; j++)
            for (size_t i = lo[0]; i < hi[0]; i++) {
                at = volume_index(from->n, i, j, k);
                if (direction_volume_is_kept(from, at)) return at;
            }
    return SIZE_MAX;
}

static void direction_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    struct direction_job *job = context;
    const struct direction_volume *from = job->from;
    const size_t *n = job->out->n;
    for (size_t j = 0; j < n[1]; j++) {
        scratch_keep_within(job->v->space);
        for (size_t i = 0; i < n[0]; i++) {
            size_t at = volume_index(n, i, j, k);
            float density = job->v->density[at];
            if (density < job->eps_d) continue;
            job->n_material[k]++;
            size_t source = source_of(job, (const size_t[3]){i, j, k});
            if (source == SIZE_MAX) continue;
            job->n_kept[k]++;
            long byte = lrintf(255.0f * density);
            job->out->density[at] = (uint8_t)(byte < 1 ? 1 : byte > 255 ? 255 : byte);
            memcpy(job->out->octahedral + 2 * at, direction_volume_code(from, source),
                   2 * sizeof *job->out->octahedral);
        }
    }
}

status direction_volume_rescale(const struct direction_volume *from, const struct volume *v, double eps_d,
                                struct thread_pool *pool, struct direction_volume *out, size_t *n_material,
                                size_t *n_kept, struct error *err)
{
    struct direction_job job = {.from = from, .v = v, .out = out, .eps_d = (float)eps_d};
    *n_material = *n_kept = 0;
    status s = direction_volume_init_in(out, v->n, v->voxel_size_m, v->space, err);
    if (s != STATUS_OK) return s;
    job.n_material = calloc(2 * v->n[2], sizeof *job.n_material);
    if (job.n_material == NULL) {
        direction_volume_release(out);
        return error_set(err, STATUS_NO_MEMORY, "cannot rescale directions: out of memory");
    }
    job.n_kept = job.n_material + v->n[2];
    s = thread_pool_run(pool, v->n[2], direction_slice, &job, NULL);
    for (size_t k = 0; k < v->n[2]; k++) {
        *n_material += job.n_material[k];
        *n_kept += job.n_kept[k];
    }
    free(job.n_material);
    if (s != STATUS_OK) {
        direction_volume_release(out);
        error_set(err, s, "rescaling directions was cancelled");
    }
    return s;
}

static void refine_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    const struct direction_job *job = context;
    struct kept_directions *k = job->out->kept_only;
    const size_t n_voxel = volume_n_voxel(job->v->n), from = i_task * VOXEL_BITS_TASK;
    scratch_keep_within(job->v->space);
    for (size_t at = from; at < n_voxel && at < from + VOXEL_BITS_TASK; at++)
        if (job->v->density[at] >= job->eps_d && job->from->density[kept_directions_holder(k, at)] > 0)
            voxel_bits_add(&k->kept, at);
}

static status find_holders(const struct direction_job *job, struct kept_directions *k, struct error *err)
{
    memcpy(k->n_coarse, job->from->n, sizeof k->n_coarse);
    k->coarse = job->from->octahedral;
    for (int a = 0; a < 3; a++) {
        k->holder[a] = malloc(k->n[a] * sizeof *k->holder[a]);
        if (k->holder[a] == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot rescale directions: out of memory");
        for (size_t i = 0; i < k->n[a]; i++) k->holder[a][i] = (uint32_t)holder(job, a, i);
    }
    return STATUS_OK;
}

status direction_volume_refine(const struct direction_volume *from, const struct volume *v, double eps_d,
                               struct thread_pool *pool, struct direction_volume *out, struct error *err)
{
    struct direction_job job = {.from = from, .v = v, .out = out, .eps_d = (float)eps_d};
    const size_t n_task = (volume_n_voxel(v->n) + VOXEL_BITS_TASK - 1) / VOXEL_BITS_TASK;
    status s = direction_volume_init_kept(out, v->n, v->voxel_size_m, v->space, err);
    if (s == STATUS_OK) s = find_holders(&job, out->kept_only, err);
    if (s == STATUS_OK) {
        s = thread_pool_run(pool, n_task, refine_task, &job, NULL);
        if (s != STATUS_OK) error_set(err, s, "rescaling directions was cancelled");
    }
    if (s != STATUS_OK) direction_volume_release(out);
    return s;
}
