#include "geometry/grade/fiber_likeness.h"

#include "geometry/volume/volume_unknown.h"

#include <math.h>

/* N_AHEAD: places between the first and the last distance ahead of an end, in diameters; N_TANGENT: vertices that the
 * direction of an end is taken over. */
enum { N_AHEAD = 6, N_TANGENT = 5 };
static const double FIRST_AHEAD = 0.3, LAST_AHEAD = 1.0;
/* Density ahead, over the density on the axis of the line, from which on an end has lost its fiber. */
static const double LEAST_AHEAD = 0.6;

/* A line, in voxels. */
struct line {
    const float *position_m;
    size_t n;
    double voxel_m, diameter, length, density;
};

static void vertex(const struct line *l, size_t i, double x[3])
{
    for (size_t a = 0; a < 3; a++) x[a] = (double)l->position_m[3 * i + a] / l->voxel_m;
}

/* Density of the voxel at x; points beyond a face count as their nearest voxels. */
static double density_near(const struct volume *v, const double x[3])
{
    size_t at[3];
    for (int a = 0; a < 3; a++) at[a] = (size_t)fmin(fmax(x[a], 0.0), (double)v->n[a] - 1.0);
    return (double)v->density[volume_index(v->n, at[0], at[1], at[2])];
}

static struct line line_of(const struct volume *v, const struct fiber_set *f, size_t i)
{
    const size_t first = f->first_vertex[i], n = f->first_vertex[i + 1] - first;
    struct line l = {f->position_m + 3 * first, n, v->voxel_size_m[0], .length = 0.0};
    double before[3];
    l.diameter = 2.0 * (double)f->radius_m[i] / l.voxel_m;
    for (size_t k = 0; k < n; k++) {
        double x[3], step2 = 0.0;
        vertex(&l, k, x);
        l.density += density_near(v, x) / (double)n;
        for (int a = 0; a < 3; a++) {
            step2 += k > 0 ? (x[a] - before[a]) * (x[a] - before[a]) : 0.0;
            before[a] = x[a];
        }
        l.length += sqrt(step2);
    }
    return l;
}

/* The place `ahead` diameters beyond an end. */
static void place_ahead(const struct line *l, bool at_start, double ahead, double x[3])
{
    const size_t span = l->n < N_TANGENT ? l->n - 1 : N_TANGENT - 1;
    double from[3], norm = 0.0;
    vertex(l, at_start ? 0 : l->n - 1, x);
    vertex(l, at_start ? span : l->n - 1 - span, from);
    for (int a = 0; a < 3; a++) norm += (x[a] - from[a]) * (x[a] - from[a]);
    norm = sqrt(norm);
    for (int a = 0; a < 3 && norm > 0.0; a++) x[a] += ahead * l->diameter * (x[a] - from[a]) / norm;
}

/* Whether the line ends inside of the scan, a diameter before its faces and unknown voxels. */
static bool ends_inside(const struct volume *v, const struct line *l, bool at_start)
{
    double x[3];
    place_ahead(l, at_start, LAST_AHEAD, x);
    for (int a = 0; a < 3; a++)
        if (x[a] < 0.0 || x[a] > (double)v->n[a]) return false;
    return !volume_unknown_near(v, (float[3]){(float)x[0], (float)x[1], (float)x[2]}, 1.0f);
}

static bool ends_in_material(const struct volume *v, const struct line *l, bool at_start)
{
    double sum = 0.0;
    for (int k = 0; k < N_AHEAD; k++) {
        double x[3];
        place_ahead(l, at_start, FIRST_AHEAD + (LAST_AHEAD - FIRST_AHEAD) * k / (N_AHEAD - 1), x);
        sum += density_near(v, x);
    }
    return sum / N_AHEAD > LEAST_AHEAD * l->density;
}

void fiber_likeness_measure(const struct volume *v, const struct fiber_set *f, float *safe, struct fiber_likeness *l)
{
    double all = 0.0, particles = 0.0;
    *l = (struct fiber_likeness){.particle_share = NAN, .fragments = NAN};
    for (size_t i = 0; i < f->n_fiber; i++) {
        const struct line line = line_of(v, f, i);
        int n_inside = 0;
        for (int at_start = 0; at_start < 2; at_start++) {
            if (!ends_inside(v, &line, at_start != 0)) continue;
            n_inside++;
            l->n_lost_end += ends_in_material(v, &line, at_start != 0);
        }
        l->n_end += (size_t)n_inside;
        all += line.length;
        if (n_inside < 2 || line.length >= FIBER_LEAST_DIAMETERS * line.diameter) continue;
        particles += line.length;
        if (safe != NULL) safe[i] = 0.0f;
    }
    if (!(all > 0.0)) return;
    l->particle_share = particles / all;
    l->fragments = (double)f->n_fiber / fmax(1.0, (double)f->n_fiber - 0.5 * (double)l->n_lost_end);
}
