#include "geometry/fibers/seam/seam_step.h"

#include <math.h>
#include <stdlib.h>

enum { N_INNER = 8, MOST_CELLS = 4096 };
static const double FIELD_DIAMETERS = 2.0;
static const double LEAST_COSINE = 0.2; /* sections of fibers that run along a plane are cut off there */

/* The section that fibers fill in two planes, in square fields of edge cell_m. */
struct fill {
    const struct fiber_set *f;
    int axis;
    size_t n[2]; /* fields along the other axis, which repeat, and in z */
    double cell[2], z0;
    double *area; /* n[1] x n[0] */
};

static void add_area(struct fill *g, double u, double z, double area)
{
    const double n = (double)g->n[0], x = u / g->cell[0] - 0.5, y = (z - g->z0) / g->cell[1] - 0.5;
    const double wrapped = x - n * floor(x / n), yc = fmin(fmax(y, 0.0), (double)(g->n[1] - 1));
    const size_t i0 = (size_t)wrapped % g->n[0], i1 = (i0 + 1) % g->n[0];
    const size_t k0 = (size_t)yc, k1 = k0 + 1 < g->n[1] ? k0 + 1 : k0;
    const double fu = wrapped - floor(wrapped), fz = yc - (double)k0;
    g->area[k0 * g->n[0] + i0] += (1.0 - fu) * (1.0 - fz) * area;
    g->area[k0 * g->n[0] + i1] += fu * (1.0 - fz) * area;
    g->area[k1 * g->n[0] + i0] += (1.0 - fu) * fz * area;
    g->area[k1 * g->n[0] + i1] += fu * fz * area;
}

/* Adds the sections with the plane at x, and with its copies in the neighbouring tiles, times `sign`. Returns the
 * sum of the sections. */
static double add_plane(struct fill *g, double x, double sign)
{
    const struct fiber_set *f = g->f;
    const double tile = f->tile_size_m[g->axis];
    double all = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) {
        const double r = (double)f->radius_m[i];
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const float *a = f->position_m + 3 * k, *b = a + 3;
            const double xa = (double)a[g->axis], xb = (double)b[g->axis], low = fmin(xa, xb), high = fmax(xa, xb);
            const double plane = x + tile * ceil((low - x) / tile); /* the first copy of the plane from `low` on */
            if (!(plane < high)) continue;
            const double t = (plane - xa) / (xb - xa), other = (double)b[1 - g->axis] - (double)a[1 - g->axis];
            const double length = hypot(hypot(xb - xa, other), (double)b[2] - (double)a[2]);
            const double area = M_PI * r * r / fmax(LEAST_COSINE, (high - low) / length);
            add_area(g, (double)a[1 - g->axis] + t * other, (double)a[2] + t * ((double)b[2] - (double)a[2]),
                     sign * area);
            all += area;
        }
    }
    return all;
}

/* The step from the plane a quarter of a diameter before x to that behind it; NaN if both are empty. */
static double step_at(struct fill *g, double x, double diameter)
{
    double sum = 0.0, all;
    for (size_t i = 0; i < g->n[0] * g->n[1]; i++) g->area[i] = 0.0;
    all = add_plane(g, x - 0.25 * diameter, 1.0);
    all += add_plane(g, x + 0.25 * diameter, -1.0);
    for (size_t i = 0; i < g->n[0] * g->n[1]; i++) sum += fabs(g->area[i]);
    return all > 0.0 ? sum / all : NAN;
}

static size_t fields_of(double length, double edge)
{
    const double n = ceil(length / edge);
    return n < 1.0 ? 1 : n > MOST_CELLS ? MOST_CELLS : (size_t)n;
}

status seam_step_measure(const struct fiber_set *f, int axis, double *step, double *inside, struct error *err)
{
    double diameter = 0.0, z_m[2];
    size_t n_inner = 0;
    struct fill g = {.f = f, .axis = axis};
    const double tile = f->tile_size_m[axis];
    for (size_t i = 0; i < f->n_fiber; i++) diameter += 2.0 * (double)f->radius_m[i] / (double)f->n_fiber;
    fiber_set_z_range_m(f, &z_m[0], &z_m[1]);
    g.z0 = z_m[0];
    g.n[0] = fields_of(f->tile_size_m[1 - axis], FIELD_DIAMETERS * diameter);
    g.n[1] = fields_of(z_m[1] - z_m[0], FIELD_DIAMETERS * diameter);
    g.cell[0] = f->tile_size_m[1 - axis] / (double)g.n[0];
    g.cell[1] = (z_m[1] - z_m[0]) / (double)g.n[1];
    g.area = malloc(g.n[0] * g.n[1] * sizeof *g.area);
    if (g.area == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the seams: out of memory");
    *step = step_at(&g, 0.0, diameter);
    *inside = 0.0;
    for (int i = 0; i < N_INNER; i++) {
        const double here = step_at(&g, tile * (0.5 + i) / N_INNER, diameter);
        if (!isfinite(here)) continue;
        *inside += here;
        n_inner++;
    }
    *inside = n_inner > 0 ? *inside / (double)n_inner : NAN;
    free(g.area);
    return STATUS_OK;
}
