#include "renderer/glint/glint_tables.h"

#include <math.h>
#include <stdlib.h>

/* Most elements that tables are made of: of more, every second one along each axis, and so on. */
enum { N_ELEMENT_MOST = 1 << 19 };

/* Covariance of an element's normals: ss, st, tt. */
static void covariance_of(const struct glint_lattice *l, const struct glint_element *e, float c[3])
{
    const float *j = e->jacobian;
    c[0] = l->variance_r + l->variance_h * (j[0] * j[0] + j[1] * j[1]);
    c[1] = l->variance_h * (j[0] * j[2] + j[1] * j[3]);
    c[2] = l->variance_r + l->variance_h * (j[2] * j[2] + j[3] * j[3]);
}

/* Nodes from one step below the least normal to one step beyond the largest. Returns whether there are
 * GLINT_TABLE_NODES_WIDE at most. */
static bool choose_nodes(const struct glint_lattice *l, struct glint_tables *t)
{
    float least[2] = {2, 2}, most[2] = {-2, -2};
    for (size_t k = 0; k < l->n * l->n; k++) {
        const struct glint_element *e = &l->element[k];
        float c[3];
        covariance_of(l, e, c);
        for (int a = 0; a < 2; a++) {
            const float reach = GLINT_REACH * sqrtf(c[2 * a]);
            least[a] = fminf(least[a], e->normal[a] - reach);
            most[a] = fmaxf(most[a], e->normal[a] + reach);
        }
    }
    const float sigma = sqrtf(l->variance_r), widest = fmaxf(most[0] - least[0], most[1] - least[1]);
    const bool is_wide = widest / (GLINT_TABLE_NODES - 4) > 1.25F * sigma;
    for (int a = 0; a < 2; a++) {
        const float range = most[a] - least[a];
        t->step[a] = fmaxf(sigma, range / (float)((is_wide ? GLINT_TABLE_NODES_WIDE : GLINT_TABLE_NODES) - 4));
        t->least[a] = least[a] - t->step[a];
        t->n_node[a] = (size_t)ceilf(range / t->step[a]) + 3;
    }
    return is_wide;
}

/* First and last node within GLINT_REACH of a mean. */
static void node_range(const struct glint_tables *t, int axis, float mean, float variance, size_t range[2])
{
    const float at = (mean - t->least[axis]) / t->step[axis], reach = GLINT_REACH * sqrtf(variance) / t->step[axis];
    range[0] = (size_t)fmaxf(ceilf(at - reach), 0);
    range[1] = (size_t)fminf(floorf(at + reach), (float)(t->n_node[axis] - 1));
}

/* Adds a density that integrates to `mass` over the interpolated table. */
static void add_element(const struct glint_tables *t, const struct glint_lattice *l, const struct glint_element *e,
                        float mass, float *table)
{
    enum { MOST = GLINT_TABLE_NODES_WIDE * GLINT_TABLE_NODES_WIDE };
    float c[3], value[MOST], sum = 0;
    size_t s[2], r[2], k = 0;
    covariance_of(l, e, c);
    for (int a = 0; a < 2; a++) c[2 * a] -= fminf(t->step[a] * t->step[a] / 6, 0.75F * l->variance_r);
    node_range(t, 0, e->normal[0], c[0], s);
    node_range(t, 1, e->normal[1], c[2], r);
    const float det = c[0] * c[2] - c[1] * c[1];
    for (size_t y = r[0]; y <= r[1]; y++)
        for (size_t x = s[0]; x <= s[1]; x++) {
            const float ds = t->least[0] + (float)x * t->step[0] - e->normal[0],
                        dt = t->least[1] + (float)y * t->step[1] - e->normal[1];
            value[k] = expf(-(ds * ds * c[2] - 2 * ds * dt * c[1] + dt * dt * c[0]) / (2 * det));
            sum += value[k++];
        }
    const float scale = mass / (sum * t->step[0] * t->step[1]);
    k = 0;
    for (size_t y = r[0]; y <= r[1]; y++)
        for (size_t x = s[0]; x <= s[1]; x++) table[y * t->n_node[0] + x] += scale * value[k++];
}

static void fill_finest(const struct glint_lattice *l, const struct glint_tables *t)
{
    const struct glint_table_level *level = &t->level[0];
    const size_t edge = l->n / level->n_tile, n = t->n_node[0] * t->n_node[1];
    size_t stride = 1;
    while (l->n * l->n / (stride * stride) > N_ELEMENT_MOST) stride *= 2;
    const float mass = (float)(stride * stride) / (float)(edge * edge);
    for (size_t y = stride / 2; y < l->n; y += stride)
        for (size_t x = stride / 2; x < l->n; x += stride)
            add_element(t, l, &l->element[glint_lattice_index(l, x, y)], mass,
                        level->density + (y / edge * level->n_tile + x / edge) * n);
}

/* A tile is the mean of four of the level below. */
static void fill_coarser(const struct glint_tables *t, size_t k)
{
    const struct glint_table_level *from = &t->level[k - 1], *to = &t->level[k];
    const size_t n = t->n_node[0] * t->n_node[1];
    for (size_t i = 0; i < from->n_tile * from->n_tile; i++) {
        const size_t x = i % from->n_tile / 2, y = i / from->n_tile / 2;
        for (size_t j = 0; j < n; j++) to->density[(y * to->n_tile + x) * n + j] += from->density[i * n + j] / 4;
    }
}

static void sum_rows(const struct glint_tables *t, const struct glint_table_level *level)
{
    for (size_t r = 0; r < level->n_tile * level->n_tile * t->n_node[1]; r++) {
        float sum = 0;
        for (size_t x = 0; x < t->n_node[0]; x++) sum += level->density[r * t->n_node[0] + x];
        level->row[r] = sum;
    }
}

status glint_tables_make(const struct glint_lattice *l, struct glint_tables *t, struct error *err)
{
    *t = (struct glint_tables){.period_um = l->period_um};
    const bool is_wide = choose_nodes(l, t);
    size_t edge = is_wide ? 2 * GLINT_TABLE_TILE : GLINT_TABLE_TILE;
    while (l->n / edge > 1U << (GLINT_TABLE_LEVELS - (is_wide ? 2 : 1))) edge *= 2;
    for (size_t n_tile = l->n > edge ? l->n / edge : 1;; n_tile /= 2) {
        struct glint_table_level *level = &t->level[t->n_level++];
        level->n_tile = n_tile;
        level->density = calloc(n_tile * n_tile * t->n_node[0] * t->n_node[1], sizeof *level->density);
        level->row = calloc(n_tile * n_tile * t->n_node[1], sizeof *level->row);
        if (level->density == NULL || level->row == NULL) {
            glint_tables_release(t);
            return error_set(err, STATUS_NO_MEMORY, "cannot make tables of glints: out of memory");
        }
        if (n_tile == 1) break;
    }
    fill_finest(l, t);
    for (size_t k = 1; k < t->n_level; k++) fill_coarser(t, k);
    for (size_t k = 0; k < t->n_level; k++) sum_rows(t, &t->level[k]);
    return STATUS_OK;
}

void glint_tables_release(struct glint_tables *t)
{
    for (size_t k = 0; k < t->n_level; k++) {
        free(t->level[k].density);
        free(t->level[k].row);
    }
    *t = (struct glint_tables){0};
}
