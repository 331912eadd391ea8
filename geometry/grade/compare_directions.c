#include "geometry/grade/compare_directions.h"
#include "base/angle.h"
#include "geometry/phantom/segment_grid.h"

#include <math.h>
#include <stdlib.h>

enum { N_BIN = 900, INSIDE = 0, RIM = 1 }; /* bins of 0.1 degree */
static const double REACH_RADII = 2.0;

struct slice_sum {
    double sum_deg[2];
    size_t n_true;
    uint32_t count[2][N_BIN];
};

struct compare_job {
    const struct fiber_set *truth;
    const struct direction_volume *d;
    const struct segment_grid *grid;
    double reach_m;
    struct slice_sum *slice;
};

static void add_error(struct slice_sum *s, int where, const float d[3], const double truth[3])
{
    double cosine = fabs((double)d[0] * truth[0] + (double)d[1] * truth[1] + (double)d[2] * truth[2]);
    double error_deg = angle_to_deg(acos(fmin(1.0, cosine)));
    size_t bin = (size_t)(error_deg * N_BIN / 90.0);
    s->sum_deg[where] += error_deg;
    s->count[where][bin < N_BIN ? bin : N_BIN - 1]++;
}

static void compare_slice(void *context, size_t k, size_t i_thread)
{
    (void)i_thread;
    const struct compare_job *job = context;
    const struct direction_volume *v = job->d;
    struct slice_sum *s = &job->slice[k];
    scratch_keep_within(v->space);
    for (size_t j = 0; j < v->n[1]; j++)
        for (size_t i = 0; i < v->n[0]; i++) {
            const double p_m[3] = {((double)i + 0.5) * v->voxel_size_m[0], ((double)j + 0.5) * v->voxel_size_m[1],
                                   ((double)k + 0.5) * v->voxel_size_m[2]};
            size_t at = volume_index(v->n, i, j, k);
            struct segment_hit hit;
            float d[3];
            if (!segment_grid_nearest(job->grid, p_m, job->reach_m, &hit)) continue;
            double radii = hit.distance_m / (double)job->truth->radius_m[hit.i_fiber];
            if (radii > REACH_RADII) continue;
            s->n_true += radii <= 1.0;
            if (v->density[at] == 0) continue;
            direction_volume_get(v, at, d);
            add_error(s, radii <= 1.0 ? INSIDE : RIM, d, hit.direction);
        }
}

/* Adds the slices in order, so that the result does not depend on the number of threads. */
static struct direction_error sum_of(const struct slice_sum *slice, size_t n_slice, int where)
{
    struct direction_error e = {NAN, NAN, 0};
    double sum_deg = 0.0;
    size_t below = 0, bin = 0, count[N_BIN] = {0};
    for (size_t k = 0; k < n_slice; k++) {
        sum_deg += slice[k].sum_deg[where];
        for (size_t b = 0; b < N_BIN; b++) count[b] += slice[k].count[where][b];
    }
    for (size_t b = 0; b < N_BIN; b++) e.n += count[b];
    if (e.n == 0) return e;
    while (bin + 1 < N_BIN && (double)(below += count[bin]) < 0.95 * (double)e.n) bin++;
    e.mean_deg = sum_deg / (double)e.n;
    e.p95_deg = (double)(bin + 1) * 90.0 / N_BIN;
    return e;
}

status compare_directions(const struct fiber_set *truth, const struct direction_volume *d, struct thread_pool *pool,
                          struct direction_compare *result, struct error *err)
{
    struct segment_grid *grid = NULL;
    double largest_m = 0.0;
    status s = fiber_set_validate(truth, err);
    if (s != STATUS_OK) return error_prefix(err, s, "true fibers");
    for (size_t i = 0; i < truth->n_fiber; i++) largest_m = fmax(largest_m, (double)truth->radius_m[i]);
    struct compare_job job = {.truth = truth, .d = d, .reach_m = REACH_RADII * largest_m};
    s = segment_grid_new(truth, truth->tile_size_m, job.reach_m, &grid, err);
    if (s != STATUS_OK) return s;
    job.grid = grid;
    job.slice = calloc(d->n[2], sizeof *job.slice);
    if (job.slice == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot compare directions: out of memory");
    if (s == STATUS_OK) s = thread_pool_run(pool, d->n[2], compare_slice, &job, NULL);
    size_t n_true = 0;
    for (size_t k = 0; k < d->n[2] && s == STATUS_OK; k++) n_true += job.slice[k].n_true;
    if (s == STATUS_OK) {
        result->inside = sum_of(job.slice, d->n[2], INSIDE);
        result->rim = sum_of(job.slice, d->n[2], RIM);
        result->kept_share = n_true > 0 ? (double)result->inside.n / (double)n_true : NAN;
    }
    free(job.slice);
    segment_grid_free(grid);
    return s;
}
