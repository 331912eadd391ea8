#include "geometry/cloth/strand_grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* limits the memory of the grid */
enum { MAX_CELLS = 1 << 26 };

static size_t wrap_cell(double x, double cell_m, size_t n_cell)
{
    double c = fmod(floor(x / cell_m), (double)n_cell);
    if (c < 0.0) c += (double)n_cell;
    return (size_t)c < n_cell ? (size_t)c : n_cell - 1;
}

static size_t clamp_cell(double x, double cell_m, size_t n_cell)
{
    double c = floor(x / cell_m);
    return c < 0.0 ? 0 : c >= (double)n_cell ? n_cell - 1 : (size_t)c;
}

/* Divides the space into cells at least a diameter wide; thin fibers in a high pile get wider ones. */
static void choose_cells(struct strand_grid *g, const double extent_m[3], double diameter_m)
{
    double edge_m = diameter_m, n_cell[3];
    do {
        for (int a = 0; a < 3; a++) n_cell[a] = fmax(1.0, floor(extent_m[a] / edge_m));
        edge_m *= 1.25;
    } while (n_cell[0] * n_cell[1] * n_cell[2] > MAX_CELLS);
    for (int a = 0; a < 3; a++) {
        g->n_cell[a] = (size_t)n_cell[a];
        g->cell_m[a] = extent_m[a] / n_cell[a];
    }
}

static size_t count_cells(const struct strand_grid *g) { return g->n_cell[0] * g->n_cell[1] * g->n_cell[2]; }

status strand_grid_init(struct strand_grid *g, const struct strand_set *s, struct error *err)
{
    double low = INFINITY, high = -INFINITY, r_max = 0.0;
    memset(g, 0, sizeof *g);
    for (size_t i = 0; i < s->n_strand; i++) r_max = fmax(r_max, s->strand[i].radius_m);
    for (size_t k = 0; k < s->n_node; k++) {
        low = fmin(low, s->start[k][2]);
        high = fmax(high, s->start[k][2]);
    }
    g->z_low_m = low - 4.0 * r_max;
    choose_cells(g, (const double[3]){s->tile_m[0], s->tile_m[1], high - low + 8.0 * r_max}, 2.0 * r_max);
    g->first = calloc(count_cells(g) + 2, sizeof *g->first);
    g->sorted = calloc(s->n_node, sizeof *g->sorted);
    g->cell_of = calloc(s->n_node, sizeof *g->cell_of);
    return g->first != NULL && g->sorted != NULL && g->cell_of != NULL
               ? STATUS_OK
               : error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
}

void strand_grid_release(struct strand_grid *g)
{
    free(g->first);
    free(g->sorted);
    free(g->cell_of);
}

void strand_grid_sort(struct strand_grid *g, const struct strand_set *s, const uint32_t *strand_of)
{
    const size_t n_cell = count_cells(g);
    memset(g->first, 0, (n_cell + 2) * sizeof *g->first);
    for (size_t k = 0; k < s->n_node; k++) {
        size_t c = (clamp_cell(s->p[k][2] - g->z_low_m, g->cell_m[2], g->n_cell[2]) * g->n_cell[1] +
                    wrap_cell(s->p[k][1], g->cell_m[1], g->n_cell[1])) *
                       g->n_cell[0] +
                   wrap_cell(s->p[k][0], g->cell_m[0], g->n_cell[0]);
        g->cell_of[k] = (uint32_t)c;
        g->first[c + 2]++;
    }
    for (size_t c = 0; c < n_cell; c++) g->first[c + 2] += g->first[c + 1];
    for (size_t k = 0; k < s->n_node; k++) {
        struct grid_node *to = &g->sorted[g->first[g->cell_of[k] + 1]++];
        memcpy(to->p, s->p[k], sizeof to->p);
        to->radius_m = s->strand[strand_of[k]].radius_m;
        to->node = (uint32_t)k;
        to->strand = strand_of[k];
    }
}

/* Adds the cells beside column at_x of the row that begins at cell `row`. */
static size_t runs_of_row(const struct strand_grid *g, size_t row, size_t at_x, struct grid_run *run)
{
    const size_t n = g->n_cell[0], reach = n >= 3 ? 3 : n; /* on a very small tile the neighbours would repeat */
    if (at_x > 0 && at_x + 1 < n) {
        run[0] = (struct grid_run){g->first[row + at_x - 1], g->first[row + at_x + 2]};
        return 1;
    }
    for (size_t dx = 0; dx < reach; dx++) {
        size_t cell = row + (at_x + n + dx - 1) % n;
        run[dx] = (struct grid_run){g->first[cell], g->first[cell + 1]};
    }
    return reach;
}

size_t strand_grid_around(const struct strand_grid *g, uint32_t cell, struct grid_run run[GRID_MAX_RUN])
{
    const size_t n_y = g->n_cell[1], at_x = cell % g->n_cell[0], at_y = cell / g->n_cell[0] % n_y,
                 at_z = cell / (g->n_cell[0] * n_y), reach = n_y >= 3 ? 3 : n_y;
    const size_t z_from = at_z > 0 ? at_z - 1 : 0, z_to = at_z + 1 < g->n_cell[2] ? at_z + 1 : at_z;
    size_t n = 0;
    for (size_t z = z_from; z <= z_to; z++)
        for (size_t dy = 0; dy < reach; dy++)
            n += runs_of_row(g, (z * n_y + (at_y + n_y + dy - 1) % n_y) * g->n_cell[0], at_x, run + n);
    return n;
}
