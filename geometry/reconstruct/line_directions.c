#include "geometry/reconstruct/line_directions.h"

#include "base/angle.h"

#include <math.h>
#include <stdlib.h>

enum { N_VOXEL = LINE_DIRECTIONS_BRICK * LINE_DIRECTIONS_BRICK * LINE_DIRECTIONS_BRICK + SEGMENT_SLACK };

struct give_job {
    const struct segment_bricks *bricks;
    struct direction_volume *d;
    bool only_compare;
    float *distance2; /* N_VOXEL per thread */
    uint32_t *nearest;
    struct line_directions *sum; /* one per brick */
};

static void give_voxel(const struct give_job *job, struct line_directions *sum, size_t at, float distance2,
                       uint32_t nearest)
{
    bool kept = job->d->density[at] > 0;
    sum->n_kept += kept;
    if (nearest == UINT32_MAX) return;
    const struct segment *g = &job->bricks->segment[nearest];
    const float r = g->radius, reach = line_directions_reach(r);
    if (distance2 <= r * r) {
        sum->n_fiber++;
        sum->n_both += kept;
    }
    if (!kept || distance2 > reach * reach) return;
    float t[3], d[3], norm = 0.0f, cosine = 0.0f;
    for (int a = 0; a < 3; a++) {
        t[a] = g->b[a] - g->a[a];
        norm += t[a] * t[a];
    }
    if (!(norm > 0.0f)) return;
    direction_volume_get(job->d, at, d);
    for (int a = 0; a < 3; a++) {
        t[a] /= sqrtf(norm);
        cosine += t[a] * d[a];
    }
    sum->angle_deg += angle_to_deg(acos(fmin(1.0, fabs((double)cosine))));
    sum->n_changed++;
    if (!job->only_compare) direction_volume_set(job->d, at, t);
}

static void give_brick(void *context, size_t i_brick, size_t i_thread)
{
    const struct give_job *job = context;
    float *distance2 = job->distance2 + i_thread * N_VOXEL;
    uint32_t *nearest = job->nearest + i_thread * N_VOXEL;
    struct point_lattice l = segment_brick_lattice(job->bricks, i_brick, 1);
    size_t from[3], n[3], p = 0;
    scratch_keep_within(job->d->space);
    segment_brick_box(job->bricks, i_brick, from, n);
    segment_distances(job->bricks, i_brick, &l, distance2, nearest);
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++, p++)
                give_voxel(job, &job->sum[i_brick], volume_index(job->d->n, from[0] + i, from[1] + j, from[2] + k),
                           distance2[p], nearest[p]);
}

static void add(const struct line_directions *part, struct line_directions *sum)
{
    sum->angle_deg += part->angle_deg;
    sum->n_changed += part->n_changed;
    sum->n_both += part->n_both;
    sum->n_fiber += part->n_fiber;
    sum->n_kept += part->n_kept;
}

static status run(struct give_job job, struct thread_pool *pool, const struct progress *progress,
                  struct line_directions *sum, struct error *err)
{
    const size_t n_thread = thread_pool_n_thread(pool), n_brick = segment_n_brick(job.bricks);
    status s = STATUS_OK;
    job.distance2 = malloc(n_thread * N_VOXEL * sizeof *job.distance2);
    job.nearest = malloc(n_thread * N_VOXEL * sizeof *job.nearest);
    job.sum = calloc(n_brick, sizeof *job.sum);
    if (job.distance2 == NULL || job.nearest == NULL || job.sum == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot transfer directions: out of memory");
    } else {
        s = thread_pool_run(pool, n_brick, give_brick, &job, progress);
        if (s != STATUS_OK) error_set(err, s, "transferring directions was cancelled");
    }
    if (sum != NULL) *sum = (struct line_directions){0};
    for (size_t b = 0; b < n_brick && s == STATUS_OK && sum != NULL; b++) add(&job.sum[b], sum);
    free(job.distance2);
    free(job.nearest);
    free(job.sum);
    return s;
}

status line_directions_give(const struct segment_bricks *bricks, struct direction_volume *d, struct thread_pool *pool,
                            const struct progress *progress, struct line_directions *sum, struct error *err)
{
    return run((struct give_job){.bricks = bricks, .d = d}, pool, progress, sum, err);
}

status line_directions_compare(const struct segment_bricks *bricks, struct direction_volume *d,
                               struct thread_pool *pool, const struct progress *progress, struct line_directions *sum,
                               struct error *err)
{
    return run((struct give_job){.bricks = bricks, .d = d, .only_compare = true}, pool, progress, sum, err);
}
