/* Step "directions": gives voxels near a fiber its direction (fabric thesis, 5.6.7), and measures the share of
 * material explained. Where the scan does not resolve single fibers, directions are averaged then. */
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/grade/unresolved_directions.h"
#include "geometry/orientation/direction_noise.h"
#include "geometry/reconstruct/line_directions.h"

#include <math.h>
#include <stdlib.h>

/* States in the report the changes that the directions of the fibers have made. */
static void state_change(const struct line_directions *all, struct reconstruct_report *report)
{
    report->dice =
        all->n_fiber + all->n_kept > 0 ? 2.0 * (double)all->n_both / (double)(all->n_fiber + all->n_kept) : 0.0;
    report->direction_change_mean_deg = all->n_changed > 0 ? all->angle_deg / (double)all->n_changed : 0.0;
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
    struct line_directions change;
    float r_max = 0.0f;
    for (size_t i = 0; i < f->n_fiber; i++) r_max = fmaxf(r_max, f->radius_m[i]);
    float reach = line_directions_reach((float)((double)r_max / d->voxel_size_m[0]));
    status s = segment_bricks_from_fibers(&bricks, f, d->n, d->voxel_size_m, LINE_DIRECTIONS_BRICK, reach, err);
    if (s != STATUS_OK) return s;
    s = direction_noise_measure(d, pool, NULL, &report->direction_noise_deg[0], err);
    if (s == STATUS_OK) s = line_directions_give(&bricks, d, pool, progress, &change, err);
    if (s == STATUS_OK) state_change(&change, report);
    if (s == STATUS_OK) s = average_unresolved(f, d, pool, report, err);
    if (s == STATUS_OK) s = direction_noise_measure(d, pool, NULL, &report->direction_noise_deg[1], err);
    if (s == STATUS_OK) count_axes(d, report->axis_share);
    segment_bricks_release(&bricks);
    return s;
}
