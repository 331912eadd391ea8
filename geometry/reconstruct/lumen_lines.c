#include "geometry/reconstruct/lumen_lines.h"

#include "geometry/grade/grade_points.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/reconstruct/trace_box.h"
#include "geometry/reconstruct/trace_job.h"

#include <math.h>

enum { N_AROUND = 8, N_CORE = 2, N_RING = 5 };
/* Rings around the axis over the radius of the line: the first N_CORE of them lie in lumens, the others in walls. */
static const double RING[N_RING] = {0.0, 0.2, 0.55, 0.7, 0.85};
static const double LEAST_DIAMETERS = 1.5; /* length of a line that is a fiber */
static const double LEAST_WALL = 0.05;     /* density */
/* Density of the axis below the densest ring of the wall, over that ring, from which on a line is hollow. */
static const double LEAST_DIP = 0.1;
/* Diameter over the width of the filled space: 3.0 to 4.1 in phantoms of hollow fibers. Beyond the first it is a
 * yarn's, and the second takes its place. */
static const double MOST_WIDTHS = 4.5, USUAL_WIDTHS = 3.6;

/* Two unit vectors perpendicular to the unit vector t and to each other. */
static void frame_of(const float t[3], double e[2][3])
{
    int least = 0;
    for (int a = 1; a < 3; a++)
        if (fabsf(t[a]) < fabsf(t[least])) least = a;
    const int b = (least + 1) % 3, c = (least + 2) % 3;
    const double length = hypot((double)t[b], (double)t[c]);
    e[0][least] = 0.0;
    e[0][b] = -(double)t[c] / length;
    e[0][c] = (double)t[b] / length;
    for (int a = 0; a < 3; a++)
        e[1][a] = (double)t[(a + 1) % 3] * e[0][(a + 2) % 3] - (double)t[(a + 2) % 3] * e[0][(a + 1) % 3];
}

/* Adds the mean densities of the rings about a vertex. */
static void add_rings(const struct volume *v, const struct polyline_set *lines, size_t line, size_t i, double ring[])
{
    float t[3];
    double e[2][3];
    polyline_tangent(lines, line, i, 2, t);
    frame_of(t, e);
    for (int g = 0; g < N_RING; g++)
        for (int k = 0; k < N_AROUND; k++) {
            const double r = RING[g] * (double)lines->radius[line], angle = 2.0 * M_PI * k / N_AROUND;
            double x[3];
            for (int a = 0; a < 3; a++)
                x[a] = (double)lines->vertex[i][a] + r * (cos(angle) * e[0][a] + sin(angle) * e[1][a]);
            ring[g] += grade_density_at(v, x) / N_AROUND;
        }
}

/* Whether the axis of a line is darker than a ring of its wall. */
static bool is_hollow(const struct volume *v, const struct polyline_set *lines, size_t line)
{
    const double n = (double)polyline_length(lines, line);
    double ring[N_RING] = {0.0}, core = 0.0, wall = LEAST_WALL;
    for (size_t i = lines->first[line]; i < lines->first[line + 1]; i++) add_rings(v, lines, line, i, ring);
    for (int g = 0; g < N_RING; g++)
        if (g < N_CORE)
            core += ring[g] / n / N_CORE;
        else
            wall = fmax(wall, ring[g] / n);
    return wall - core > LEAST_DIP * wall;
}

/* Share of the lines' mass that is hollow. */
static double share_of_hollow(const struct volume *v, const struct polyline_set *lines, double diameter)
{
    double all = 0.0, hollow = 0.0;
    for (size_t l = 0; l < lines->n_line; l++) {
        const double n = (double)polyline_length(lines, l), r = (double)lines->radius[l];
        if (n < LEAST_DIAMETERS * diameter) continue;
        all += n * r * r;
        if (is_hollow(v, lines, l)) hollow += n * r * r;
    }
    return all > 0.0 ? hollow / all : NAN;
}

/* Gives the voxels of a box that begins at `from` the densities that they had before they were filled. */
static void empty_box(const struct volume *v, const size_t from[3], struct volume *box)
{
    const struct volume_filled *f = &v->filled;
    for (size_t i = 0; i < f->n; i++) {
        const size_t at = f->voxel[i];
        const size_t x[3] = {at % v->n[0] - from[0], at / v->n[0] % v->n[1] - from[1],
                             at / (v->n[0] * v->n[1]) - from[2]}; /* huge before `from` */
        if (x[0] < box->n[0] && x[1] < box->n[1] && x[2] < box->n[2])
            box->density[volume_index(box->n, x[0], x[1], x[2])] = f->density[i];
    }
}

/* Traces lines in a box. No lines where nothing in it looks like a fiber. report: a copy, which gets their spread. */
static status trace_in_box(const struct volume *box, double diameter, struct thread_pool *pool,
                           struct reconstruct_report *report, struct polyline_set *lines, struct error *err)
{
    struct direction_volume d = {0};
    struct reconstruct_option o;
    struct trace_job job = {.v = box, .d = &d, .o = &o, .pool = pool, .report = report};
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = diameter;
    report->radius_spread = 0.0;
    status s = reconstruct_orientation_again(box, &o, pool, NULL, &d, report, err);
    if (s == STATUS_OK) {
        trace_job_start(&job);
        s = trace_scan(&job, false, lines, err);
    }
    direction_volume_release(&d);
    return s == STATUS_INVALID ? STATUS_OK : s;
}

status lumen_lines_measure(const struct volume *v, double diameter_voxel, struct thread_pool *pool,
                           const struct reconstruct_report *report, struct lumen_evidence *e, struct error *err)
{
    struct reconstruct_report look = *report;
    const double width = report->lumen.width_voxel;
    const double diameter = diameter_voxel > MOST_WIDTHS * width ? USUAL_WIDTHS * width : diameter_voxel;
    struct volume box = {0};
    struct polyline_set lines;
    size_t from[3];
    e->hollow_share = e->radius_spread = NAN;
    polyline_set_init(&lines);
    status s = trace_box_copy(v, v, diameter, 0, &box, from, err);
    if (s == STATUS_OK) s = trace_in_box(&box, diameter, pool, &look, &lines, err);
    if (s == STATUS_OK) {
        empty_box(v, from, &box);
        e->hollow_share = share_of_hollow(&box, &lines, diameter);
        if (lines.n_line > 0) e->radius_spread = look.radius_spread;
    }
    polyline_set_release(&lines);
    volume_release(&box);
    return s;
}
