#include "geometry/grade/grade_points.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

static const double PARALLEL = 0.86602540378443865; /* cosine of 30 degrees */
enum { MAX_CELLS = 1 << 24 };

/* Walks along a fiber in steps; to NULL: counts. */
static size_t walk(const struct fiber_set *f, size_t i, double voxel_m, struct grade_point *to)
{
    double step = 0.5 * (double)f->radius_m[i] / voxel_m, to_next = 0.5 * step;
    size_t n = 0;
    for (size_t v = f->first_vertex[i]; v + 1 < f->first_vertex[i + 1]; v++) {
        double a[3], d[3], length = 0.0;
        for (size_t k = 0; k < 3; k++) {
            a[k] = (double)f->position_m[3 * v + k] / voxel_m;
            d[k] = (double)f->position_m[3 * v + 3 + k] / voxel_m - a[k];
            length += d[k] * d[k];
        }
        length = sqrt(length);
        if (!(length > 0.0)) continue;
        for (; to_next <= length; to_next += step, n++) {
            if (to == NULL) continue;
            for (int k = 0; k < 3; k++) {
                to[n].t[k] = (float)(d[k] / length);
                to[n].p[k] = (float)(a[k] + to_next * d[k] / length);
            }
            to[n].fiber = (uint32_t)i;
        }
        to_next -= length;
    }
    return n;
}

static size_t cell_of(const struct grade_points *g, const float p[3], int a)
{
    double c = floor(((double)p[a] - g->low[a]) / g->cell);
    return c < 0.0 ? 0 : c >= (double)g->n_cell[a] ? g->n_cell[a] - 1 : (size_t)c;
}

static size_t cell_index(const struct grade_points *g, const size_t c[3])
{
    return (c[2] * g->n_cell[1] + c[1]) * g->n_cell[0] + c[0];
}

static void choose_cells(struct grade_points *g, double reach_voxel)
{
    double high[3];
    for (int a = 0; a < 3; a++) {
        g->low[a] = INFINITY;
        high[a] = -INFINITY;
        for (size_t i = 0; i < g->n; i++) {
            g->low[a] = fmin(g->low[a], (double)g->point[i].p[a]);
            high[a] = fmax(high[a], (double)g->point[i].p[a]);
        }
    }
    double n[3];
    g->cell = reach_voxel;
    for (;; g->cell *= 1.25) {
        for (int a = 0; a < 3; a++) n[a] = g->n == 0 ? 1.0 : floor((high[a] - g->low[a]) / g->cell) + 1.0;
        if (n[0] * n[1] * n[2] <= MAX_CELLS) break;
    }
    for (int a = 0; a < 3; a++) g->n_cell[a] = (size_t)n[a];
}

static status sort_into_cells(struct grade_points *g, struct error *err)
{
    size_t n_cell = g->n_cell[0] * g->n_cell[1] * g->n_cell[2];
    g->cell_first = calloc(n_cell + 2, sizeof *g->cell_first);
    g->in_cell = malloc((g->n + 1) * sizeof *g->in_cell);
    if (g->cell_first == NULL || g->in_cell == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    for (int pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < g->n; i++) {
            size_t c[3];
            for (int a = 0; a < 3; a++) c[a] = cell_of(g, g->point[i].p, a);
            if (pass == 0)
                g->cell_first[cell_index(g, c) + 2]++;
            else
                g->in_cell[g->cell_first[cell_index(g, c) + 1]++] = (uint32_t)i;
        }
        for (size_t c = 0; pass == 0 && c < n_cell; c++) g->cell_first[c + 2] += g->cell_first[c + 1];
    }
    return STATUS_OK;
}

status grade_points_make(struct grade_points *g, const struct fiber_set *f, double voxel_m, double reach,
                         struct error *err)
{
    double widest = 0.0;
    *g = (struct grade_points){.first = calloc(f->n_fiber + 1, sizeof *g->first),
                               .radius = calloc(f->n_fiber + 1, sizeof *g->radius)};
    if (g->first == NULL || g->radius == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    for (size_t i = 0; i < f->n_fiber; i++) {
        g->radius[i] = (double)f->radius_m[i] / voxel_m;
        widest = fmax(widest, g->radius[i]);
        g->first[i + 1] = g->first[i] + walk(f, i, voxel_m, NULL);
    }
    g->n = g->first[f->n_fiber];
    g->point = malloc((g->n + 1) * sizeof *g->point);
    if (g->point == NULL || g->n > UINT32_MAX)
        return error_set(err, STATUS_NO_MEMORY, "cannot grade the scan: out of memory");
    for (size_t i = 0; i < f->n_fiber; i++) walk(f, i, voxel_m, g->point + g->first[i]);
    choose_cells(g, fmax(1.0, 2.0 * widest * reach));
    return sort_into_cells(g, err);
}

void grade_points_release(struct grade_points *g)
{
    free(g->point);
    free(g->first);
    free(g->radius);
    free(g->cell_first);
    free(g->in_cell);
    *g = (struct grade_points){0};
}

/* Distance of q from p across the direction of p, or infinity if q is no point beside it. */
static double beside(const struct grade_points *g, const struct grade_point *p, const struct grade_point *q,
                     double least, double most)
{
    double along = 0.0, d2 = 0.0, cosine = 0.0, sum = g->radius[p->fiber] + g->radius[q->fiber];
    if (p->fiber == q->fiber) return INFINITY;
    for (int a = 0; a < 3; a++) {
        double d = (double)q->p[a] - (double)p->p[a];
        along += d * (double)p->t[a];
        d2 += d * d;
        cosine += (double)p->t[a] * (double)q->t[a];
    }
    double across = sqrt(fmax(0.0, d2 - along * along));
    bool level = fabs(along) <= 0.5 * g->radius[q->fiber], apart = across >= least * sum && across <= most * sum;
    return level && apart && fabs(cosine) >= PARALLEL ? across : INFINITY;
}

/* The cells around a point. */
static void cells_around(const struct grade_points *g, const struct grade_point *p, size_t from[3], size_t to[3])
{
    for (int a = 0; a < 3; a++) {
        size_t at = cell_of(g, p->p, a);
        from[a] = at > 0 ? at - 1 : 0;
        to[a] = at + 1 < g->n_cell[a] ? at + 1 : at;
    }
}

const struct grade_point *grade_points_beside(const struct grade_points *g, size_t i, double least, double most)
{
    const struct grade_point *p = &g->point[i], *nearest = NULL;
    double best = INFINITY;
    size_t from[3], to[3], c[3];
    cells_around(g, p, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++)
                for (size_t k = g->cell_first[cell_index(g, c)]; k < g->cell_first[cell_index(g, c) + 1]; k++) {
                    double d = beside(g, p, &g->point[g->in_cell[k]], least, most);
                    if (d >= best) continue;
                    best = d;
                    nearest = &g->point[g->in_cell[k]];
                }
    return nearest;
}

static double distance2(const struct grade_point *p, const struct grade_point *q)
{
    double d2 = 0.0;
    for (int a = 0; a < 3; a++) d2 += ((double)q->p[a] - (double)p->p[a]) * ((double)q->p[a] - (double)p->p[a]);
    return d2;
}

/* Adds q to the list, or puts it in the place of a farther point of its fiber. */
static size_t add_near(const struct grade_point *p, const struct grade_point *q, const struct grade_point **near,
                       size_t n, size_t n_most)
{
    for (size_t i = 0; i < n; i++)
        if (near[i]->fiber == q->fiber) {
            if (distance2(p, q) < distance2(p, near[i])) near[i] = q;
            return n;
        }
    if (n < n_most) near[n++] = q;
    return n;
}

size_t grade_points_near(const struct grade_points *g, size_t i, double reach, const struct grade_point **near,
                         size_t n_most)
{
    const struct grade_point *p = &g->point[i];
    size_t from[3], to[3], c[3], n = 1;
    near[0] = p;
    cells_around(g, p, from, to);
    for (c[2] = from[2]; c[2] <= to[2]; c[2]++)
        for (c[1] = from[1]; c[1] <= to[1]; c[1]++)
            for (c[0] = from[0]; c[0] <= to[0]; c[0]++)
                for (size_t k = g->cell_first[cell_index(g, c)]; k < g->cell_first[cell_index(g, c) + 1]; k++) {
                    const struct grade_point *q = &g->point[g->in_cell[k]];
                    double most = reach + g->radius[q->fiber];
                    if (distance2(p, q) <= most * most) n = add_near(p, q, near, n, n_most);
                }
    return n;
}

double grade_density_at(const struct volume *v, const double x[3])
{
    size_t i[3];
    double f[3], sum = 0.0;
    for (int a = 0; a < 3; a++) {
        double c = fmin(fmax(x[a] - 0.5, 0.0), (double)v->n[a] - 1.0);
        i[a] = (size_t)c;
        if (i[a] + 1 == v->n[a] && i[a] > 0) i[a]--;
        f[a] = v->n[a] > 1 ? c - (double)i[a] : 0.0;
    }
    for (size_t corner = 0; corner < 8; corner++) {
        double weight = 1.0;
        size_t at[3];
        for (size_t a = 0; a < 3; a++) {
            size_t up = corner >> a & 1;
            weight *= up ? f[a] : 1.0 - f[a];
            at[a] = i[a] + (v->n[a] > 1 ? up : 0);
        }
        if (weight > 0.0) sum += weight * (double)v->density[volume_index(v->n, at[0], at[1], at[2])];
    }
    return sum;
}
