/* Directions of a noisy scan by the lines that are found in it.
 *
 * The line filter sees a few diameters of a fiber, and strong noise turns its directions: by 20 degrees in the mean in
 * a plain weave at signal-to-noise 2, where chains then end and change from fiber to fiber. Lines that follow a fiber
 * farther know its direction better. Voxels near them take theirs, and lines that are traced once more in these
 * directions are longer. So are they where fibers are flat, light, or so thin that voxels are interpolated, and the
 * lines in a part of the scan end in the middle of material. */
#include "geometry/reconstruct/line_directions.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>

/* Tracings for the directions alone. The lines that are traced afterwards gain nothing by a third one
 * (geometry/NOTES.md, "Directions by traced lines in noisy scans"). */
enum { N_ROUND = 2, N_ROUND_THIN = 1 /* where voxels are interpolated */ };
/* Noise over the step from void to material from which on lines are traced for their directions. */
static const double LEAST_NOISE = 0.3;

/* Gives voxels within a diameter of a line its direction. */
static status take_directions(const struct polyline_set *lines, struct direction_volume *d, struct thread_pool *pool,
                              struct error *err)
{
    struct segment_bricks bricks = {0};
    float most = 0.0f;
    for (size_t i = 0; i < lines->n_line; i++) most = fmaxf(most, lines->radius[i]);
    status s = segment_bricks_init(&bricks, lines, d->n, LINE_DIRECTIONS_BRICK, line_directions_reach(most), err);
    if (s != STATUS_OK) return s;
    s = line_directions_give(&bricks, d, pool, NULL, NULL, err);
    segment_bricks_release(&bricks);
    return s;
}

static bool is_noisy(const struct reconstruct_report *report) { return report->noise.scan_sd >= LEAST_NOISE; }

bool reconstruct_redirects(const struct reconstruct_report *report) { return is_noisy(report) || report->in_pieces; }

status reconstruct_redirect(const struct volume *v, struct direction_volume *d, const struct reconstruct_option *o,
                            struct thread_pool *pool, const struct progress *progress,
                            const struct reconstruct_report *report, struct error *err)
{
    status s = STATUS_OK;
    const bool thin = report->trace_edge_voxel < 1.0;
    const int n_round = thin ? N_ROUND_THIN : N_ROUND;
    bool again = reconstruct_redirects(report) && !(thin && is_noisy(report));
    for (int round = 0; round < n_round && again && s == STATUS_OK; round++) {
        struct reconstruct_report look = *report;
        struct reconstruct_option option = *o;
        struct progress_part part = {progress, (double)round / n_round, 1.0 / n_round / TRACE_FINISHED_END};
        const struct progress inner = progress_of_part(&part);
        struct trace_job job = {.v = v, .d = d, .o = &option, .pool = pool, .report = &look, .part.outer = &inner};
        struct polyline_set lines;
        polyline_set_init(&lines);
        look.radius_spread = 0.0;
        trace_job_start(&job);
        s = trace_scan(&job, true, &lines, err);
        const bool fibers = lines.n_line > 0 && look.radius_spread <= TRACE_MOST_SPREAD;
        if (s == STATUS_OK && fibers) s = take_directions(&lines, d, pool, err);
        again = fibers;
        polyline_set_release(&lines);
    }
    if (s == STATUS_OK) progress_report(progress, 1.0);
    return s;
}
