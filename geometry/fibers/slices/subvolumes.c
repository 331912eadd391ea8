#include "geometry/fibers/slices/subvolumes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct slice_count {
    size_t n[3];           /* number of kept voxels by nearest axis */
    size_t from[2], to[2]; /* box around the kept voxels in x and y */
};

struct mask_job {
    const struct direction_volume *d;
    bool disjoint;
    uint16_t *mask;
    float normal[N_SLICE_FRAME][3];
    struct slice_count *count;
};

static unsigned frames_of(const struct mask_job *job, const float d[3])
{
    unsigned bits = 0;
    for (unsigned f = 0; f < N_SLICE_FRAME; f++) {
        const float *w = job->normal[f];
        if (fabsf(d[0] * w[0] + d[1] * w[1] + d[2] * w[2]) >= CLASS_COSINE) bits |= 1u << f;
    }
    return bits;
}

static void mask_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct mask_job *job = context;
    const size_t *n = job->d->n;
    struct slice_count c = {.from = {n[0], n[1]}};
    size_t x[2], at = k * n[0] * n[1];
    scratch_keep_within(job->d->space);
    for (x[1] = 0; x[1] < n[1]; x[1]++)
        for (x[0] = 0; x[0] < n[0]; x[0]++, at++) {
            if (!direction_volume_is_kept(job->d, at)) continue;
            float d[3];
            direction_volume_get(job->d, at, d);
            int nearest = 0;
            for (int a = 1; a < 3; a++)
                if (fabsf(d[a]) > fabsf(d[nearest])) nearest = a;
            job->mask[at] = (uint16_t)(1u << (12 + nearest) | (job->disjoint ? 1u << nearest : frames_of(job, d)));
            c.n[nearest]++;
            for (int a = 0; a < 2; a++) {
                c.from[a] = x[a] < c.from[a] ? x[a] : c.from[a];
                c.to[a] = x[a] >= c.to[a] ? x[a] + 1 : c.to[a];
            }
        }
    job->count[k] = c;
}

/* Shows an empty voxel in the frames of its kept neighbours, or in all frames if it has none. So the rim of a fiber
 * appears only in the frames of the fiber. */
static void rim_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct mask_job *job = context;
    const size_t *n = job->d->n, stride[3] = {1, n[0], n[0] * n[1]};
    size_t x[3] = {0, 0, k}, at = k * stride[2];
    scratch_keep_within(job->d->space);
    for (x[1] = 0; x[1] < n[1]; x[1]++)
        for (x[0] = 0; x[0] < n[0]; x[0]++, at++) {
            if (direction_volume_is_kept(job->d, at)) continue;
            unsigned seen = 0;
            for (int a = 0; a < 3; a++) { /* only kept neighbours are read, because their masks do not change here */
                if (x[a] > 0 && direction_volume_is_kept(job->d, at - stride[a])) seen |= job->mask[at - stride[a]];
                if (x[a] + 1 < n[a] && direction_volume_is_kept(job->d, at + stride[a]))
                    seen |= job->mask[at + stride[a]];
            }
            job->mask[at] = (uint16_t)((seen == 0 ? ~0u : seen) & ((1u << N_SLICE_FRAME) - 1u));
        }
}

static void reduce(struct subvolumes *s, const struct mask_job *job)
{
    const size_t *n = job->d->n;
    for (int a = 0; a < 3; a++) s->from[a] = n[a];
    for (size_t k = 0; k < n[2]; k++) {
        const struct slice_count *c = &job->count[k];
        for (int a = 0; a < 3; a++) s->n_class_voxel[a] += c->n[a];
        if (c->n[0] + c->n[1] + c->n[2] == 0) continue;
        for (int a = 0; a < 2; a++) {
            if (c->from[a] < s->from[a]) s->from[a] = c->from[a];
            if (c->to[a] > s->to[a]) s->to[a] = c->to[a];
        }
        if (s->from[2] == n[2]) s->from[2] = k;
        s->to[2] = k + 1;
    }
    for (int a = 0; a < 3; a++)
        if (s->from[a] > s->to[a]) s->from[a] = s->to[a];
}

status subvolumes_init(struct subvolumes *s, const struct direction_volume *d, bool disjoint, struct thread_pool *pool,
                       struct error *err)
{
    void *mask;
    *s = (struct subvolumes){.space = d->space};
    status st = scratch_new(d->space, volume_n_voxel(d->n) * sizeof *s->mask, "the axes of voxels", &mask, err);
    s->mask = mask;
    if (st != STATUS_OK) return st;
    struct mask_job job = {.d = d, .disjoint = disjoint, .mask = s->mask, .count = calloc(d->n[2], sizeof *job.count)};
    if (job.count == NULL) {
        subvolumes_release(s);
        return error_set(err, STATUS_NO_MEMORY, "cannot separate the axes: out of memory");
    }
    for (int f = 0; f < N_SLICE_FRAME; f++) slice_frame_normal(f, job.normal[f]);
    st = thread_pool_run(pool, d->n[2], mask_slice, &job, NULL);
    if (st == STATUS_OK) st = thread_pool_run(pool, d->n[2], rim_slice, &job, NULL);
    reduce(s, &job);
    free(job.count);
    return st;
}

void subvolumes_release(struct subvolumes *s)
{
    if (s == NULL) return;
    scratch_release(s->space, s->mask);
    *s = (struct subvolumes){0};
}
