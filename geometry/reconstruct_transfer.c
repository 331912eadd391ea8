/* Step "directions": gives voxels near a fiber its direction (fabric thesis, 5.6.7), and measures the share of
 * material explained. Where the scan does not resolve single fibers, directions are averaged then. */
#include "base/angle.h"
#include "geometry/reconstruct.h"

#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/grade/unresolved_directions.h"
#include "geometry/orientation/direction_noise.h"

#include <math.h>
#include <stdlib.h>

enum { BRICK = 32, N_VOXEL = BRICK * BRICK * BRICK + SEGMENT_SLACK };

struct transfer_job {
    const struct segment_bricks *bricks;
    const struct fiber_set *fibers;
    struct direction_volume *d;
    float *distance2; /* N_VOXEL per thread */
    uint32_t *nearest;
    struct brick_sum {
        double angle_deg;
        size_t n_changed, n_both, n_fiber, n_kept;
    } * sum; /* one per brick */
};

static void transfer_voxel(struct transfer_job *job, struct brick_sum *sum, size_t at, float distance2,
                           uint32_t nearest)
{
    bool kept = job->d->density[at] > 0;
    sum->n_kept += kept;
    if (nearest == UINT32_MAX) return;
    const struct segment *g = &job->bricks->segment[nearest];
    const float r = g->radius;
    if (distance2 <= r * r) {
        sum->n_fiber++;
        sum->n_both += kept;
    }
    if (!kept || distance2 > 4.0f * r * r) return;
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
    direction_volume_set(job->d, at, t);
}

static void transfer_brick(void *context, size_t i_brick, size_t i_thread)
{
    struct transfer_job *job = context;
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
                transfer_voxel(job, &job->sum[i_brick], volume_index(job->d->n, from[0] + i, from[1] + j, from[2] + k),
                               distance2[p], nearest[p]);
}

static void reduce(const struct transfer_job *job, size_t n_brick, struct reconstruct_report *report)
{
    struct brick_sum all = {0};
    for (size_t b = 0; b < n_brick; b++) {
        all.angle_deg += job->sum[b].angle_deg;
        all.n_changed += job->sum[b].n_changed;
        all.n_both += job->sum[b].n_both;
        all.n_fiber += job->sum[b].n_fiber;
        all.n_kept += job->sum[b].n_kept;
    }
    report->dice = all.n_fiber + all.n_kept > 0 ? 2.0 * (double)all.n_both / (double)(all.n_fiber + all.n_kept) : 0.0;
    report->direction_change_mean_deg = all.n_changed > 0 ? all.angle_deg / (double)all.n_changed : 0.0;
}

/* Averages directions where the lines are none that the scan shows. */
static status average_unresolved(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                                 const struct reconstruct_report *report, struct error *err)
{
    double sum_m = 0.0;
    if (report->grade.verdict != GRADE_UNRESOLVED || f->n_fiber == 0) return STATUS_OK;
    for (size_t i = 0; i < f->n_fiber; i++) sum_m += (double)f->radius_m[i];
    return unresolved_directions_average(d, 2.0 * sum_m / (double)f->n_fiber / d->voxel_size_m[0], pool, NULL, err);
}

/* How the material runs. */
static void count_axes(const struct direction_volume *d, double share[3])
{
    const size_t n_voxel = volume_n_voxel(d->n);
    size_t n[3] = {0, 0, 0};
    for (size_t i = 0; i < n_voxel; i++) {
        float u[3];
        if (d->density[i] == 0) continue;
        direction_volume_get(d, i, u);
        const int across = fabsf(u[1]) > fabsf(u[0]) ? 1 : 0;
        n[fabsf(u[2]) > fabsf(u[across]) ? 2 : across]++;
    }
    const double all = (double)(n[0] + n[1] + n[2]);
    for (int a = 0; a < 3; a++) share[a] = all > 0.0 ? (double)n[a] / all : 0.0;
}

status reconstruct_transfer(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    struct segment_bricks bricks = {0};
    size_t n_thread = thread_pool_n_thread(pool);
    float r_max = 0.0f;
    for (size_t i = 0; i < f->n_fiber; i++) r_max = fmaxf(r_max, f->radius_m[i]);
    float reach = (float)(2.0 * (double)r_max / d->voxel_size_m[0]);
    status s = segment_bricks_from_fibers(&bricks, f, d->n, d->voxel_size_m, BRICK, reach, err);
    if (s == STATUS_OK) s = direction_noise_measure(d, pool, NULL, &report->direction_noise_deg[0], err);
    if (s != STATUS_OK) {
        segment_bricks_release(&bricks);
        return s;
    }
    size_t n_brick = segment_n_brick(&bricks);
    struct transfer_job job = {.bricks = &bricks, .fibers = f, .d = d};
    job.distance2 = malloc(n_thread * N_VOXEL * sizeof *job.distance2);
    job.nearest = malloc(n_thread * N_VOXEL * sizeof *job.nearest);
    job.sum = calloc(n_brick, sizeof *job.sum);
    if (job.distance2 == NULL || job.nearest == NULL || job.sum == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot transfer directions: out of memory");
    } else {
        s = thread_pool_run(pool, n_brick, transfer_brick, &job, progress);
        if (s != STATUS_OK) error_set(err, s, "transferring directions was cancelled");
    }
    if (s == STATUS_OK) reduce(&job, n_brick, report);
    if (s == STATUS_OK) s = average_unresolved(f, d, pool, report, err);
    if (s == STATUS_OK) s = direction_noise_measure(d, pool, NULL, &report->direction_noise_deg[1], err);
    if (s == STATUS_OK) count_axes(d, report->axis_share);
    free(job.distance2);
    free(job.nearest);
    free(job.sum);
    segment_bricks_release(&bricks);
    return s;
}
