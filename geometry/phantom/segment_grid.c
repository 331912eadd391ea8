#include "geometry/phantom/segment_grid.h"

#include <math.h>
#include <stdlib.h>

enum { CELLS_MAX = 1 << 24 };

struct segment_grid {
    const struct fiber_set *f;
    double tile_m[2], z_low_m, cell_m[3];
    long n[3];
    size_t *cell_first;
    uint32_t *cell_segment; /* first vertex of the segment */
    uint32_t *fiber_of;     /* vertex -> fiber */
};

struct cell_range {
    long low[3], high[3];
};

/* Cells touched by a box. x and y may exceed the tile by at most one period; they are wrapped later. */
static struct cell_range range_of(const struct segment_grid *g, const double low[3], const double high[3])
{
    struct cell_range r;
    for (int a = 0; a < 3; a++) {
        double origin = a == 2 ? g->z_low_m : 0.0;
        r.low[a] = (long)floor((low[a] - origin) / g->cell_m[a]);
        r.high[a] = (long)floor((high[a] - origin) / g->cell_m[a]);
        if (a < 2 && r.high[a] - r.low[a] >= g->n[a]) r.high[a] = r.low[a] + g->n[a] - 1;
    }
    r.low[2] = r.low[2] < 0 ? 0 : r.low[2];
    r.high[2] = r.high[2] >= g->n[2] ? g->n[2] - 1 : r.high[2];
    return r;
}

static size_t cell_index(const struct segment_grid *g, long i, long j, long k)
{
    long x = (i % g->n[0] + g->n[0]) % g->n[0], y = (j % g->n[1] + g->n[1]) % g->n[1];
    return (size_t)((k * g->n[1] + y) * g->n[0] + x);
}

/* Pass 0 counts, and pass 1 fills. */
static void enter_segments(struct segment_grid *g, int pass)
{
    const struct fiber_set *f = g->f;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t v = f->first_vertex[i]; v < f->first_vertex[i + 1]; v++) {
            g->fiber_of[v] = (uint32_t)i;
            if (v + 1 == f->first_vertex[i + 1]) continue;
            double low[3], high[3];
            for (size_t a = 0; a < 3; a++) {
                low[a] = fmin((double)f->position_m[3 * v + a], (double)f->position_m[3 * v + 3 + a]);
                high[a] = fmax((double)f->position_m[3 * v + a], (double)f->position_m[3 * v + 3 + a]);
            }
            struct cell_range r = range_of(g, low, high);
            for (long k = r.low[2]; k <= r.high[2]; k++)
                for (long y = r.low[1]; y <= r.high[1]; y++)
                    for (long x = r.low[0]; x <= r.high[0]; x++) {
                        size_t c = cell_index(g, x, y, k);
                        if (pass == 0)
                            g->cell_first[c + 2]++;
                        else
                            g->cell_segment[g->cell_first[c + 1]++] = (uint32_t)v;
                    }
        }
}

status segment_grid_new(const struct fiber_set *f, const double tile_m[2], double reach_m, struct segment_grid **grid,
                        struct error *err)
{
    struct segment_grid *g = calloc(1, sizeof *g);
    if (g == NULL) goto out;
    g->f = f;
    double low, high;
    fiber_set_z_range_m(f, &low, &high);
    g->z_low_m = low - reach_m;
    double extent[3] = {tile_m[0], tile_m[1], high - low + 2.0 * reach_m}, cell_m = reach_m;
    while (extent[0] * extent[1] * extent[2] / (cell_m * cell_m * cell_m) > CELLS_MAX) cell_m *= 2.0;
    size_t n_cell = 1;
    for (int a = 0; a < 3; a++) {
        g->n[a] = (long)fmax(1.0, floor(extent[a] / cell_m));
        g->cell_m[a] = extent[a] / (double)g->n[a];
        n_cell *= (size_t)g->n[a];
        if (a < 2) g->tile_m[a] = tile_m[a];
    }
    g->cell_first = calloc(n_cell + 2, sizeof *g->cell_first);
    g->fiber_of = calloc(f->n_vertex, sizeof *g->fiber_of);
    if (g->cell_first == NULL || g->fiber_of == NULL) goto out;
    enter_segments(g, 0);
    for (size_t c = 0; c < n_cell; c++) g->cell_first[c + 2] += g->cell_first[c + 1];
    g->cell_segment = calloc(g->cell_first[n_cell + 1] + 1, sizeof *g->cell_segment);
    if (g->cell_segment == NULL) goto out;
    enter_segments(g, 1);
    *grid = g;
    return STATUS_OK;
out:
    segment_grid_free(g);
    return error_set(err, STATUS_NO_MEMORY, "cannot index %zu fibers: out of memory", f->n_fiber);
}

void segment_grid_free(struct segment_grid *g)
{
    if (g == NULL) return;
    free(g->cell_first);
    free(g->cell_segment);
    free(g->fiber_of);
    free(g);
}

static void look_at(const struct segment_grid *g, size_t v, const double p[3], struct segment_hit *best, double *best2)
{
    const float *a = g->f->position_m + 3 * v, *b = a + 3;
    double q[3], d[3], length2 = 0.0, dot = 0.0, middle;
    for (int k = 0; k < 3; k++) {
        d[k] = (double)b[k] - a[k];
        q[k] = p[k] - (double)a[k];
        middle = q[k] - 0.5 * d[k];
        if (k < 2) q[k] -= g->tile_m[k] * rint(middle / g->tile_m[k]);
        length2 += d[k] * d[k];
        dot += d[k] * q[k];
    }
    double t = length2 > 0.0 ? fmax(0.0, fmin(1.0, dot / length2)) : 0.0, distance2 = 0.0;
    for (int k = 0; k < 3; k++) distance2 += (q[k] - t * d[k]) * (q[k] - t * d[k]);
    /* of equal distances the lower number wins, whatever the order of the cells */
    if (distance2 > *best2 || (distance2 == *best2 && v >= best->i_vertex)) return;
    *best2 = distance2;
    best->i_vertex = v;
    best->t = t;
    for (int k = 0; k < 3; k++) best->direction[k] = length2 > 0.0 ? d[k] / sqrt(length2) : 0.0;
}

bool segment_grid_nearest(const struct segment_grid *g, const double p_m[3], double limit_m, struct segment_hit *hit)
{
    double low[3], high[3], best2 = limit_m * limit_m;
    struct segment_hit best = {.i_vertex = SIZE_MAX};
    for (int a = 0; a < 3; a++) {
        low[a] = p_m[a] - limit_m;
        high[a] = p_m[a] + limit_m;
    }
    struct cell_range r = range_of(g, low, high);
    for (long k = r.low[2]; k <= r.high[2]; k++)
        for (long j = r.low[1]; j <= r.high[1]; j++)
            for (long i = r.low[0]; i <= r.high[0]; i++) {
                size_t c = cell_index(g, i, j, k);
                for (size_t m = g->cell_first[c]; m < g->cell_first[c + 1]; m++)
                    look_at(g, g->cell_segment[m], p_m, &best, &best2);
            }
    if (best.i_vertex == SIZE_MAX) return false;
    best.i_fiber = g->fiber_of[best.i_vertex];
    best.distance_m = sqrt(best2);
    *hit = best;
    return true;
}
