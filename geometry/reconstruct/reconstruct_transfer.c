/* Step "directions": gives voxels near a fiber its direction (fabric thesis, 5.6.7), and measures the share of
 * material explained. Then voxels in a fiber get the share that it fills as their density. Where the scan does not
 * resolve single fibers, densities stay, and directions are averaged. */
#include "geometry/reconstruct/reconstruct.h"

#include "geometry/grade/unresolved_directions.h"
#include "geometry/orientation/direction_noise.h"
#include "geometry/reconstruct/line_densities.h"
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

static const double MOST_SCALE = 1.25, MOST_GROWTH = 1.03;
static const double EDGE_SHIFT = 0.35; /* 0.5 for single cylinders */

/* Returns the radius by the edges of the fibers over the mean of their radii, which are scaled to their mass. Mass
 * counts blurred fibers as too thick, because the blur lowers the density on their axes that it is compared with, and
 * those with bright rims as too thin. Blur moves the edge of a single cylinder inwards by blur^2 / (2 radius), and
 * 0.7 of it remains where neighbours touch. 1 where radii are those by the edges or were given. */
static double edges_over_mass(const struct fiber_set *f, const struct reconstruct_report *report)
{
    const double edge = report->profile_radius_m, blur = report->profile_blur_m;
    double sum = 0.0, length = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) {
        const double n = (double)(f->first_vertex[i + 1] - f->first_vertex[i]);
        sum += n * (double)f->radius_m[i];
        length += n;
    }
    if (report->lumens_measured || isnan(report->radius_se_m[0]) || !(edge > 0.0) || !(sum > 0.0)) return 1.0;
    const double scale = (edge + EDGE_SHIFT * blur * blur / edge) * length / sum;
    return isfinite(scale) ? fmin(fmax(scale, 1.0 / MOST_SCALE), MOST_SCALE) : 1.0;
}

/* Length of the part of a segment inside of a volume of n voxels. */
static double length_inside(const struct segment *g, const size_t n[3])
{
    double from = 0.0, to = 1.0, length2 = 0.0;
    for (int a = 0; a < 3; a++) {
        const double start = (double)g->a[a], step = (double)(g->b[a] - g->a[a]), end = (double)n[a];
        length2 += step * step;
        if (step == 0.0 && (start < 0.0 || start > end)) return 0.0;
        if (step == 0.0) continue;
        from = fmax(from, fmin(-start / step, (end - start) / step));
        to = fmin(to, fmax(-start / step, (end - start) / step));
    }
    return fmax(0.0, to - from) * sqrt(length2);
}

/* Volume of the fibers inside of the grid, in voxels. */
static double volume_of(const struct segment_bricks *bricks, double radius_scale)
{
    double sum = 0.0;
    for (size_t i = 0; i < bricks->n_segment; i++) {
        const double r = radius_scale * (double)bricks->segment[i].radius;
        sum += M_PI * r * r * length_inside(&bricks->segment[i], bricks->n_voxel);
    }
    return sum;
}

/* Replaces the densities in and around fibers by the shares of the voxels that they fill. Sections of fibers that touch
 * overlap a little, so that the sum is below their volume, and radii are made so much larger. */
static status fill_densities(const struct fiber_set *f, struct direction_volume *d, float r_max,
                             struct thread_pool *pool, const struct reconstruct_report *report, struct error *err)
{
    struct segment_bricks bricks = {0};
    const double blur = report->profile_blur_m / d->voxel_size_m[0];
    struct line_densities l = {edges_over_mass(f, report), 0.5 + (isfinite(blur) ? blur : 0.0)};
    double sum = 0.0;
    if (report->grade.verdict == GRADE_UNRESOLVED || f->n_fiber == 0) return STATUS_OK;
    const float reach = line_densities_reach(&l, f, (float)(MOST_GROWTH * (double)r_max / d->voxel_size_m[0]));
    status s = segment_bricks_from_fibers(&bricks, f, d->n, d->voxel_size_m, LINE_DIRECTIONS_BRICK, reach, err);
    if (s == STATUS_OK) s = line_densities_give(&l, &bricks, f, d, pool, &sum, err);
    const double growth = sum > 0.0 ? fmin(sqrt(volume_of(&bricks, l.radius_scale) / sum), MOST_GROWTH) : 1.0;
    l.radius_scale *= growth;
    if (s == STATUS_OK && growth > 1.0) s = line_densities_give(&l, &bricks, f, d, pool, &sum, err);
    segment_bricks_release(&bricks);
    return s;
}

static float largest_radius_m(const struct fiber_set *f)
{
    float r_max = 0.0f;
    for (size_t i = 0; i < f->n_fiber; i++) r_max = fmaxf(r_max, f->radius_m[i]);
    return r_max;
}

/* Sorts the segments of the fibers into bricks that reach as far as their directions do. */
static status brick_lines(const struct fiber_set *f, const struct direction_volume *d, struct segment_bricks *bricks,
                          struct error *err)
{
    const float reach = line_directions_reach((float)((double)largest_radius_m(f) / d->voxel_size_m[0]));
    return segment_bricks_from_fibers(bricks, f, d->n, d->voxel_size_m, LINE_DIRECTIONS_BRICK, reach, err);
}

status reconstruct_transfer(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err)
{
    struct segment_bricks bricks = {0};
    struct line_directions change;
    status s = brick_lines(f, d, &bricks, err);
    if (s != STATUS_OK) return s;
    s = direction_noise_measure(d, pool, NULL, &report->direction_noise_deg[0], err);
    if (s == STATUS_OK) s = line_directions_give(&bricks, d, pool, progress, &change, err);
    if (s == STATUS_OK) state_change(&change, report);
    if (s == STATUS_OK) s = average_unresolved(f, d, pool, report, err);
    if (s == STATUS_OK) s = direction_noise_measure(d, pool, NULL, &report->direction_noise_deg[1], err);
    if (s == STATUS_OK) count_axes(d, report->axis_share);
    segment_bricks_release(&bricks);
    return s == STATUS_OK ? fill_densities(f, d, largest_radius_m(f), pool, report, err) : s;
}

status reconstruct_keep_directions(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                                   const struct progress *progress, struct reconstruct_report *report,
                                   struct error *err)
{
    struct segment_bricks bricks = {0};
    struct line_directions change;
    status s = brick_lines(f, d, &bricks, err);
    if (s != STATUS_OK) return s;
    s = direction_noise_measure(d, pool, NULL, &report->direction_noise_deg[0], err);
    report->direction_noise_deg[1] = report->direction_noise_deg[0];
    if (s == STATUS_OK) s = line_directions_compare(&bricks, d, pool, progress, &change, err);
    if (s == STATUS_OK) state_change(&change, report);
    if (s == STATUS_OK) count_axes(d, report->axis_share);
    segment_bricks_release(&bricks);
    return s;
}
