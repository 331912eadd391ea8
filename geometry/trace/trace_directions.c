/* Directions of a noisy scan by the lines that are found in it.
 *
 * The line filter sees a few diameters of a fiber, and strong noise turns its directions: by 20 degrees in the mean in
 * a plain weave at signal-to-noise 2, where chains then end and change from fiber to fiber. Lines that follow a fiber
 * farther know its direction better. Voxels near them take theirs, and lines that are traced once more in these
 * directions are longer. */
#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/trace/trace_job.h"

#include <math.h>
#include <stdlib.h>

enum { BRICK = 32, N_VOXEL = BRICK * BRICK * BRICK + SEGMENT_SLACK, N_ROUND = 4 };
/* Rounds end where the number of lines, which are pieces of fibers, has not fallen to this share of the last one. */
static const double LEAST_FALL = 0.97;
/* Noise over the step from void to material from which on lines are traced for their directions (geometry/NOTES.md). */
static const double LEAST_NOISE = 0.3;

struct line_directions {
    const struct segment_bricks *bricks;
    struct direction_volume *d;
    float *distance2; /* N_VOXEL per thread */
    uint32_t *nearest;
};

static void turn_voxel(const struct line_directions *job, size_t at, float distance2, uint32_t nearest)
{
    if (job->d->density[at] == 0 || nearest == UINT32_MAX) return;
    const struct segment *g = &job->bricks->segment[nearest];
    float t[3], norm = 0.0f;
    if (distance2 > 4.0f * g->radius * g->radius) return;
    for (int a = 0; a < 3; a++) {
        t[a] = g->b[a] - g->a[a];
        norm += t[a] * t[a];
    }
    if (norm > 0.0f) direction_volume_set(job->d, at, t);
}

static void turn_brick(void *context, size_t i_brick, size_t i_thread)
{
    const struct line_directions *job = context;
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
                turn_voxel(job, volume_index(job->d->n, from[0] + i, from[1] + j, from[2] + k), distance2[p],
                           nearest[p]);
}

/* Gives voxels within a diameter of a line its direction. */
static status take_directions(const struct polyline_set *lines, struct direction_volume *d, struct thread_pool *pool,
                              struct error *err)
{
    struct segment_bricks bricks = {0};
    const size_t n_thread = thread_pool_n_thread(pool);
    float most = 0.0f;
    for (size_t i = 0; i < lines->n_line; i++) most = fmaxf(most, lines->radius[i]);
    status s = segment_bricks_init(&bricks, lines, d->n, BRICK, 2.0f * most, err);
    if (s != STATUS_OK) return s;
    struct line_directions job = {.bricks = &bricks,
                                  .d = d,
                                  .distance2 = malloc(n_thread * N_VOXEL * sizeof *job.distance2),
                                  .nearest = malloc(n_thread * N_VOXEL * sizeof *job.nearest)};
    s = job.distance2 == NULL || job.nearest == NULL ? STATUS_NO_MEMORY : STATUS_OK;
    if (s == STATUS_OK) s = thread_pool_run(pool, segment_n_brick(&bricks), turn_brick, &job, NULL);
    if (s != STATUS_OK) error_set(err, s, "cannot take directions from lines");
    free(job.distance2);
    free(job.nearest);
    segment_bricks_release(&bricks);
    return s;
}

bool reconstruct_redirects(const struct reconstruct_report *report) { return report->noise.scan_sd >= LEAST_NOISE; }

status reconstruct_redirect(const struct volume *v, struct direction_volume *d, const struct reconstruct_option *o,
                            struct thread_pool *pool, const struct progress *progress,
                            const struct reconstruct_report *report, struct error *err)
{
    status s = STATUS_OK;
    bool again = reconstruct_redirects(report) && report->trace_edge_voxel >= 1.0;
    size_t n_before = SIZE_MAX;
    for (int round = 0; round < N_ROUND && again && s == STATUS_OK; round++) {
        struct reconstruct_report look = *report;
        struct reconstruct_option option = *o;
        struct progress_part part = {progress, (double)round / N_ROUND, 1.0 / N_ROUND};
        const struct progress inner = progress_of_part(&part);
        struct trace_job job = {.v = v, .d = d, .o = &option, .pool = pool, .report = &look, .part.outer = &inner};
        struct polyline_set lines;
        polyline_set_init(&lines);
        look.radius_spread = 0.0;
        trace_job_start(&job);
        s = trace_scan(&job, true, &lines, err);
        const bool fibers = lines.n_line > 0 && look.radius_spread <= TRACE_MOST_SPREAD;
        if (s == STATUS_OK && fibers) s = take_directions(&lines, d, pool, err);
        again = fibers && (double)lines.n_line < LEAST_FALL * (double)n_before;
        n_before = lines.n_line;
        polyline_set_release(&lines);
    }
    if (s == STATUS_OK) progress_report(progress, 1.0);
    return s;
}
