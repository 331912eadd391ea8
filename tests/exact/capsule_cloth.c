#include "tests/exact/capsule_cloth.h"
#include "tests/exact/capsule_entry.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MM_PER_M 1e3

enum { MOST_CELLS_A_SIDE = 256 };
/* Edge of a cell in mean radii. */
static const double cell_radii = 3.0;

static void add_fiber(struct capsule_cloth *c, const struct fiber_set *f, size_t i, double z_top_m)
{
    for (size_t v = f->first_vertex[i]; v + 1 < f->first_vertex[i + 1]; v++) {
        struct capsule *p = &c->capsule[c->n_capsule];
        for (size_t k = 0; k < 3; k++) {
            const double top = k == 2 ? z_top_m : 0.0;
            p->a[k] = ((double)f->position_m[3 * v + k] - top) * MM_PER_M;
            p->b[k] = ((double)f->position_m[3 * v + 3 + k] - top) * MM_PER_M;
        }
        for (size_t k = 0; k < 2; k++) p->radius[k] = (double)fiber_radius_m(f, i, v + k) * MM_PER_M;
        capsule_finish(p);
        if (p->length > 0.0) c->fiber[c->n_capsule++] = (uint32_t)i;
    }
}

static void bounds(const struct capsule *p, double low[3], double high[3])
{
    for (int k = 0; k < 3; k++) {
        low[k] = fmin(p->a[k] - p->radius[0], p->b[k] - p->radius[1]);
        high[k] = fmax(p->a[k] + p->radius[0], p->b[k] + p->radius[1]);
    }
}

static void place_grid(struct capsule_cloth *c)
{
    double radius = 0.0, z[2] = {INFINITY, -INFINITY};
    for (size_t i = 0; i < c->n_capsule; i++) {
        double low[3], high[3];
        bounds(&c->capsule[i], low, high);
        radius += c->capsule[i].radius[0] / (double)c->n_capsule;
        z[0] = fmin(z[0], low[2]);
        z[1] = fmax(z[1], high[2]);
    }
    c->low_mm[2] = z[0];
    for (int k = 0; k < 3; k++) {
        const double edge = k < 2 ? c->tile_mm[k] : z[1] - z[0];
        c->n_cell[k] = (int)fmin(fmax(floor(edge / (cell_radii * radius)), 1.0), MOST_CELLS_A_SIDE);
        c->cell_mm[k] = edge / c->n_cell[k];
    }
}

/* Counts capsule i in every cell that its box meets, or enters it there. A slice of 1e-6 of a cell more makes up for
 * rounding. */
static void add_capsule(struct capsule_cloth *c, size_t i, uint32_t *count, bool enter)
{
    double low[3], high[3];
    int from[3], to[3], at[3];
    bounds(&c->capsule[i], low, high);
    for (int k = 0; k < 3; k++) {
        from[k] = (int)floor((low[k] - c->low_mm[k]) / c->cell_mm[k] - 1e-6);
        to[k] = (int)floor((high[k] - c->low_mm[k]) / c->cell_mm[k] + 1e-6);
    }
    from[2] = from[2] < 0 ? 0 : from[2];
    to[2] = to[2] >= c->n_cell[2] ? c->n_cell[2] - 1 : to[2];
    for (at[2] = from[2]; at[2] <= to[2]; at[2]++)
        for (at[1] = from[1]; at[1] <= to[1]; at[1]++)
            for (at[0] = from[0]; at[0] <= to[0]; at[0]++) {
                int tile[2];
                const size_t cell = capsule_cell(c, at, tile);
                if (enter)
                    c->entry[c->first[cell] + count[cell]] = (struct capsule_entry){(uint32_t)i, {-tile[0], -tile[1]}};
                count[cell]++;
            }
}

static bool fill_grid(struct capsule_cloth *c)
{
    const size_t n = (size_t)c->n_cell[0] * (size_t)c->n_cell[1] * (size_t)c->n_cell[2];
    uint32_t *count = calloc(n, sizeof *count);
    c->first = malloc((n + 1) * sizeof *c->first);
    if (count == NULL || c->first == NULL) {
        free(count);
        return false;
    }
    for (size_t i = 0; i < c->n_capsule; i++) add_capsule(c, i, count, false);
    c->first[0] = 0;
    for (size_t k = 0; k < n; k++) c->first[k + 1] = c->first[k] + count[k];
    c->entry = malloc((c->first[n] + 1) * sizeof *c->entry);
    memset(count, 0, n * sizeof *count);
    for (size_t i = 0; i < c->n_capsule && c->entry != NULL; i++) add_capsule(c, i, count, true);
    free(count);
    return c->entry != NULL;
}

bool capsule_cloth_init(struct capsule_cloth *c, const struct fiber_set *f, double z_top_m)
{
    memset(c, 0, sizeof *c);
    for (int k = 0; k < 2; k++) c->tile_mm[k] = f->tile_size_m[k] * MM_PER_M;
    c->capsule = malloc(f->n_vertex * sizeof *c->capsule);
    c->fiber = malloc(f->n_vertex * sizeof *c->fiber);
    if (c->capsule == NULL || c->fiber == NULL || !tube_links_find(&c->links, f)) return false;
    for (size_t i = 0; i < f->n_fiber; i++) add_fiber(c, f, i, z_top_m);
    place_grid(c);
    return fill_grid(c);
}

void capsule_cloth_release(struct capsule_cloth *c)
{
    tube_links_release(&c->links);
    free(c->capsule);
    free(c->fiber);
    free(c->first);
    free(c->entry);
    memset(c, 0, sizeof *c);
}

bool capsule_cloth_project(const struct capsule_cloth *c, uint32_t i_capsule, double within_mm, double x[3])
{
    const struct capsule *p = &c->capsule[i_capsule];
    double best = INFINITY, whole[2], y[3] = {0.0, 0.0, x[2]}, normal[3], radius;
    int tile[2];
    for (int k = 0; k < 2; k++) tile[k] = (int)floor((x[k] - 0.5 * (p->a[k] + p->b[k])) / c->tile_mm[k] + 0.5);
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++) {
            const double shift[2] = {(tile[0] + i) * c->tile_mm[0], (tile[1] + j) * c->tile_mm[1]},
                         there[3] = {x[0] - shift[0], x[1] - shift[1], x[2]};
            const double away = fabs(capsule_distance(p, there, normal, &radius));
            if (away >= best) continue;
            best = away;
            memcpy(whole, shift, sizeof whole);
            memcpy(y, there, sizeof y);
        }
    if (best > within_mm) return false;
    for (int i = 0; i < 3; i++) {
        const double away = capsule_distance(p, y, normal, &radius);
        for (int k = 0; k < 3; k++) y[k] -= away * normal[k];
    }
    for (int k = 0; k < 3; k++) x[k] = y[k] + (k < 2 ? whole[k] : 0.0);
    return true;
}
