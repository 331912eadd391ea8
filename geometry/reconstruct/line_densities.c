#include "geometry/reconstruct/line_densities.h"

#include "geometry/reconstruct/line_directions.h"

#include <math.h>
#include <stdlib.h>

enum { N_VOXEL = LINE_DIRECTIONS_BRICK * LINE_DIRECTIONS_BRICK * LINE_DIRECTIONS_BRICK + SEGMENT_SLACK };
static const float HALF_VOXEL = 0.5f;

struct density_job {
    const struct line_densities *option;
    const struct segment_bricks *bricks;
    const struct fiber_set *f;
    struct direction_volume *d;
    float *distance2; /* N_VOXEL per thread */
    uint32_t *nearest;
    uint64_t *sum; /* of the densities in fibers, one per brick */
};

float line_densities_reach(const struct line_densities *l, const struct fiber_set *f, float radius_voxel)
{
    float ratio = 1.0f;
    for (size_t i = 0; i < f->n_vertex && f->shape != NULL; i++) ratio = fmaxf(ratio, f->shape[i].ratio);
    return (float)l->radius_scale * radius_voxel * sqrtf(ratio) + fmaxf(HALF_VOXEL, (float)l->halo_voxel) + 1.0f;
}

/* Radius of the section of a segment towards a point x. Segments are in the order of the vertices, one fewer for each
 * fiber, so the vertex at the start of segment i is i + line. */
static float radius_towards(const struct density_job *job, uint32_t i, const float x[3])
{
    const struct segment *g = &job->bricks->segment[i];
    const float r = (float)job->option->radius_scale * g->radius;
    float t[3], to[3], along = 0.0f, length2 = 0.0f, across = 0.0f, distance2 = 0.0f;
    if (job->f->shape == NULL) return r;
    const struct fiber_shape *s = &job->f->shape[(size_t)i + g->line];
    if (!fiber_shape_has_section(s)) return r;
    for (int a = 0; a < 3; a++) {
        t[a] = g->b[a] - g->a[a];
        to[a] = x[a] - g->a[a];
        along += t[a] * to[a];
        length2 += t[a] * t[a];
    }
    for (int a = 0; a < 3; a++) {
        to[a] -= length2 > 0.0f ? along / length2 * t[a] : 0.0f;
        across += to[a] * s->long_axis[a];
        distance2 += to[a] * to[a];
    }
    if (!(distance2 > 0.0f)) return r;
    const float cosine2 = fminf(1.0f, across * across / distance2);
    return r / sqrtf(cosine2 / s->ratio + (1.0f - cosine2) * s->ratio);
}

/* Returns the density of the voxel if it is in a fiber. */
static uint8_t give_voxel(const struct density_job *job, size_t at, const float x[3], float distance2, uint32_t nearest)
{
    struct direction_volume *d = job->d;
    if (nearest == UINT32_MAX) return 0;
    const float away = sqrtf(distance2) - radius_towards(job, nearest, x);
    const float share = fminf(1.0f, HALF_VOXEL - away);
    if (share <= 0.0f) {
        if (d->density[at] > 1 && away <= (float)job->option->halo_voxel) d->density[at] = 1;
        return 0;
    }
    if (d->density[at] == 0) {
        const struct segment *g = &job->bricks->segment[nearest];
        const float t[3] = {g->b[0] - g->a[0], g->b[1] - g->a[1], g->b[2] - g->a[2]};
        if (!(t[0] * t[0] + t[1] * t[1] + t[2] * t[2] > 0.0f)) return 0;
        direction_volume_set(d, at, t);
    }
    return d->density[at] = (uint8_t)fmaxf(1.0f, rintf(255.0f * share));
}

static void give_brick(void *context, size_t i_brick, size_t i_thread)
{
    const struct density_job *job = context;
    float *distance2 = job->distance2 + i_thread * N_VOXEL;
    uint32_t *nearest = job->nearest + i_thread * N_VOXEL;
    const struct point_lattice l = segment_brick_lattice(job->bricks, i_brick, 1);
    size_t from[3], n[3], p = 0;
    scratch_keep_within(job->d->space);
    segment_brick_box(job->bricks, i_brick, from, n);
    segment_distances(job->bricks, i_brick, &l, distance2, nearest);
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++, p++) {
                const size_t x[3] = {from[0] + i, from[1] + j, from[2] + k};
                const float center[3] = {(float)x[0] + 0.5f, (float)x[1] + 0.5f, (float)x[2] + 0.5f};
                job->sum[i_brick] +=
                    give_voxel(job, volume_index(job->d->n, x[0], x[1], x[2]), center, distance2[p], nearest[p]);
            }
}

status line_densities_give(const struct line_densities *l, const struct segment_bricks *bricks,
                           const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                           double *sum_voxel, struct error *err)
{
    const size_t n_thread = thread_pool_n_thread(pool), n_brick = segment_n_brick(bricks);
    struct density_job job = {.option = l, .bricks = bricks, .f = f, .d = d};
    status s = STATUS_OK;
    job.distance2 = malloc(n_thread * N_VOXEL * sizeof *job.distance2);
    job.nearest = malloc(n_thread * N_VOXEL * sizeof *job.nearest);
    job.sum = calloc(n_brick, sizeof *job.sum);
    if (job.distance2 == NULL || job.nearest == NULL || job.sum == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot find the densities of fibers: out of memory");
    } else {
        s = thread_pool_run(pool, n_brick, give_brick, &job, NULL);
        if (s != STATUS_OK) error_set(err, s, "finding the densities of fibers was cancelled");
    }
    *sum_voxel = 0.0;
    for (size_t b = 0; b < n_brick && s == STATUS_OK; b++) *sum_voxel += (double)job.sum[b] / 255.0;
    free(job.distance2);
    free(job.nearest);
    free(job.sum);
    return s;
}
