#include "renderer/glint/glint_cells.h"

#include "renderer/glint/glint_window.h"

#include <math.h>
#include <stdlib.h>

/* Half the extent of an element along s and t. */
static void reach_of(const struct glint_lattice *l, const struct glint_element *e, float reach[2])
{
    const float *j = e->jacobian;
    for (int c = 0; c < 2; c++)
        reach[c] =
            GLINT_REACH * sqrtf(l->variance_r + l->variance_h * (j[2 * c] * j[2 * c] + j[2 * c + 1] * j[2 * c + 1]));
}

/* The range of cells that an element reaches into; first > last: none. */
static void cells_of(const struct glint_cells *c, const struct glint_lattice *l, const struct glint_element *e,
                     int first[2], int last[2])
{
    float reach[2];
    reach_of(l, e, reach);
    for (int a = 0; a < 2; a++) {
        first[a] = (int)fmaxf(0, floorf((e->normal[a] - reach[a] - c->least[a]) * c->per_cell[a]));
        last[a] = (int)fminf(GLINT_N_CELL - 1, floorf((e->normal[a] + reach[a] - c->least[a]) * c->per_cell[a]));
    }
}

static void bounds(const struct glint_lattice *l, struct glint_cells *c)
{
    float most[2] = {-1, -1};
    c->least[0] = c->least[1] = 1;
    for (size_t k = 0; k < l->n * l->n; k++) {
        float reach[2];
        reach_of(l, &l->element[k], reach);
        for (int a = 0; a < 2; a++) {
            c->least[a] = fminf(c->least[a], fmaxf(l->element[k].normal[a] - reach[a], -1));
            most[a] = fmaxf(most[a], fminf(l->element[k].normal[a] + reach[a], 1));
        }
    }
    for (int a = 0; a < 2; a++) c->per_cell[a] = GLINT_N_CELL / (most[a] - c->least[a]);
}

/* Counts the entries of every list, or writes them: `next` has one number for each list. */
static void visit(const struct glint_lattice *l, const struct glint_cells *c, uint32_t *next, uint32_t *index)
{
    const size_t n_tile2 = c->n_tile * c->n_tile;
    for (size_t k = 0; k < l->n * l->n; k++) {
        const size_t tile = k / (GLINT_TILE * GLINT_TILE);
        int first[2], last[2];
        cells_of(c, l, &l->element[k], first, last);
        for (int t = first[1]; t <= last[1]; t++)
            for (int s = first[0]; s <= last[0]; s++) {
                uint32_t *at = &next[(size_t)(t * GLINT_N_CELL + s) * n_tile2 + tile];
                if (index != NULL) index[*at] = (uint32_t)k;
                ++*at;
            }
    }
}

status glint_cells_make(const struct glint_lattice *l, struct glint_cells *c, struct error *err)
{
    *c = (struct glint_cells){.n_tile = l->n / GLINT_TILE};
    const size_t n_list = c->n_tile * c->n_tile * GLINT_N_CELL * GLINT_N_CELL;
    bounds(l, c);
    c->start = calloc(n_list + 1, sizeof *c->start);
    uint32_t *next = malloc(n_list * sizeof *next);
    uint64_t sum = 0;
    if (c->start != NULL && next != NULL) {
        visit(l, c, c->start, NULL);
        for (size_t k = 0; k < n_list; k++) {
            const uint32_t n = c->start[k];
            c->start[k] = next[k] = (uint32_t)sum;
            sum += n;
        }
        c->start[n_list] = (uint32_t)sum;
        if (sum <= UINT32_MAX) c->index = malloc((sum > 0 ? sum : 1) * sizeof *c->index);
        if (c->index != NULL) visit(l, c, next, c->index);
    }
    free(next);
    if (c->index != NULL) return STATUS_OK;
    glint_cells_release(c);
    return error_set(err, STATUS_NO_MEMORY, "cannot make the hierarchy of glint elements: out of memory");
}

void glint_cells_release(struct glint_cells *c)
{
    free(c->start);
    free(c->index);
    *c = (struct glint_cells){0};
}

/* Sum over a row of tiles, cut where the map repeats. */
static float row_sum(const struct glint_cells *c, const struct glint_lattice *l, const struct glint_query *q,
                     const uint32_t *start, const int64_t range[2], float shift_v_um, const float half[2])
{
    const int64_t n = (int64_t)c->n_tile;
    float sum = 0;
    for (int64_t x = range[0]; x <= range[1];) {
        const int64_t period = glint_floor_div(x, n),
                      end = range[1] < (period + 1) * n - 1 ? range[1] : (period + 1) * n - 1;
        const uint32_t first = start[x - period * n], last = start[end - period * n + 1];
        const float shift[2] = {(float)period * l->period_um, shift_v_um};
        if (last > first) sum += glint_query_sum(q, l->element, c->index + first, last - first, shift, half);
        x = end + 1;
    }
    return sum;
}

float glint_cells_sum(const struct glint_cells *c, const struct glint_lattice *l, const struct glint_query *q,
                      const float half[2])
{
    const struct glint_window w = {.center_um = {q->center_um[0], q->center_um[1]},
                                   .covariance_um2 = {q->wide[0], q->wide[1], q->wide[2]},
                                   .reach = GLINT_REACH,
                                   .tile_um = GLINT_TILE * l->step_um};
    const float at[2] = {(half[0] - c->least[0]) * c->per_cell[0], (half[1] - c->least[1]) * c->per_cell[1]};
    const int64_t n = (int64_t)c->n_tile;
    float sum = 0;
    int64_t row[2], range[2];
    if (!(at[0] >= 0 && at[1] >= 0 && at[0] < GLINT_N_CELL && at[1] < GLINT_N_CELL)) return 0;
    const uint32_t *start = c->start + (size_t)((int)at[1] * GLINT_N_CELL + (int)at[0]) * c->n_tile * c->n_tile;
    glint_window_rows(&w, row);
    for (int64_t k = row[0]; k <= row[1]; k++) {
        const int64_t period = glint_floor_div(k, n);
        if (!glint_window_row(&w, k, range)) continue;
        sum += row_sum(c, l, q, start + (k - period * n) * n, range, (float)period * l->period_um, half);
    }
    return sum;
}
