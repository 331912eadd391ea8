#include "geometry/cloth/strand_grid.h"

#include "base/lanes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* limits the memory of the grid */
enum { MAX_CELLS = 1 << 26 };

/* Cell of x in a periodic row, and x moved to where that cell is. */
static size_t wrap_cell(double x, double cell_m, size_t n_cell, float *moved)
{
    const double at = floor(x / cell_m), n = (double)n_cell;
    double c = at;
    if (!(at >= 0.0 && at < n)) {
        c = fmod(at, n);
        if (c < 0.0) c += n;
    }
    *moved = (float)(x - (at - c) * cell_m);
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
    g->most_radius_m = r_max;
    choose_cells(g, (const double[3]){s->tile_m[0], s->tile_m[1], high - low + 8.0 * r_max}, 2.0 * r_max);
    g->first = calloc(count_cells(g) + 2, sizeof *g->first);
    g->sorted = calloc(s->n_node, sizeof *g->sorted);
    g->cell_of = calloc(s->n_node, sizeof *g->cell_of);
    g->node = calloc(s->n_node + LANES, sizeof *g->node);
    bool whole = g->first != NULL && g->sorted != NULL && g->cell_of != NULL && g->node != NULL;
    for (int a = 0; a < 3; a++) {
        g->at[a] = calloc(s->n_node + LANES, sizeof *g->at[a]);
        whole = whole && g->at[a] != NULL;
    }
    return whole ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
}

void strand_grid_release(struct strand_grid *g)
{
    free(g->first);
    free(g->sorted);
    free(g->cell_of);
    free(g->node);
    for (int a = 0; a < 3; a++) free(g->at[a]);
}

void strand_grid_sort(struct strand_grid *g, const struct strand_set *s, const uint32_t *strand_of)
{
    const size_t n_cell = count_cells(g);
    memset(g->first, 0, (n_cell + 2) * sizeof *g->first);
    for (size_t k = 0; k < s->n_node; k++) {
        float moved;
        size_t c = (clamp_cell(s->p[k][2] - g->z_low_m, g->cell_m[2], g->n_cell[2]) * g->n_cell[1] +
                    wrap_cell(s->p[k][1], g->cell_m[1], g->n_cell[1], &moved)) *
                       g->n_cell[0] +
                   wrap_cell(s->p[k][0], g->cell_m[0], g->n_cell[0], &moved);
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
    double far_m = s->tile_m[0] + s->tile_m[1];
    for (size_t k = 0; k < s->n_node; k++) {
        const double *p = g->sorted[k].p;
        for (int a = 0; a < 2; a++) wrap_cell(p[a], g->cell_m[a], g->n_cell[a], &g->at[a][k]);
        g->at[2][k] = (float)p[2];
        g->node[k] = (int32_t)g->sorted[k].node;
        far_m = fmax(far_m, fabs(p[2]));
    }
    g->rounding_m = far_m * FLT_EPSILON;
}

size_t strand_grid_rows(const struct strand_grid *g, size_t i_row, struct grid_row row[GRID_MAX_ROW])
{
    const size_t n_y = g->n_cell[1], at_y = i_row % n_y, at_z = i_row / n_y;
    const size_t reach = n_y >= 3 ? 3 : n_y; /* on a very small tile the neighbours would repeat */
    const size_t z_from = at_z > 0 ? at_z - 1 : 0, z_to = at_z + 1 < g->n_cell[2] ? at_z + 1 : at_z;
    const float tile_m = (float)((double)n_y * g->cell_m[1]);
    size_t n = 0;
    for (size_t z = z_from; z <= z_to; z++)
        for (size_t dy = 0; dy < reach; dy++) {
            size_t y = at_y + n_y + dy - 1;
            float shift_m = y < n_y ? -tile_m : y < 2 * n_y ? 0.0f : tile_m;
            row[n++] = (struct grid_row){(z * n_y + y % n_y) * g->n_cell[0], shift_m};
        }
    return n;
}

size_t strand_grid_runs(const struct strand_grid *g, const struct grid_row *row, size_t n_row, size_t at_x,
                        struct grid_run run[GRID_MAX_RUN])
{
    const size_t n_x = g->n_cell[0], reach = n_x >= 3 ? 3 : n_x;
    const float tile_m = (float)((double)n_x * g->cell_m[0]);
    size_t n = 0;
    for (size_t i = 0; i < n_row; i++) {
        const uint32_t *first = g->first + row[i].first_cell;
        if (at_x > 0 && at_x + 1 < n_x) {
            run[n++] = (struct grid_run){first[at_x - 1], first[at_x + 2], {0.0f, row[i].shift_m}};
            continue;
        }
        for (size_t dx = 0; dx < reach; dx++) {
            size_t x = at_x + n_x + dx - 1;
            float shift_m = x < n_x ? -tile_m : x < 2 * n_x ? 0.0f : tile_m;
            run[n++] = (struct grid_run){first[x % n_x], first[x % n_x + 1], {shift_m, row[i].shift_m}};
        }
    }
    return n;
}

bool strand_grid_is_narrow(const struct strand_grid *g) { return g->n_cell[0] < 3 || g->n_cell[1] < 3; }
