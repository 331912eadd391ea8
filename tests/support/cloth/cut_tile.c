#include "tests/support/cloth/cut_tile.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>

#include <cmocka.h>

struct cutter {
    const struct fiber_set *f;
    const double *size_m;
    double skew;
    struct fiber_set *tile; /* NULL: the pieces are counted */
    size_t n_fiber, n_vertex, n_run;
};

static void vertex_of(const struct cutter *c, size_t i, double p[3])
{
    for (size_t a = 0; a < 3; a++) p[a] = (double)c->f->position_m[3 * i + a];
    p[1] += c->skew * p[0];
}

/* The part from t[0] to t[1] of the way from a to b that lies in the tile; false if there is none. */
static bool clip(const struct cutter *c, const double a[3], const double b[3], double t[2])
{
    t[0] = 0.0;
    t[1] = 1.0;
    for (int k = 0; k < 2; k++) {
        const double d = b[k] - a[k];
        const double low = d != 0.0 ? -a[k] / d : a[k] >= 0.0 ? -1.0 : 2.0;
        const double high = d != 0.0 ? (c->size_m[k] - a[k]) / d : a[k] <= c->size_m[k] ? 2.0 : -1.0;
        const double from = low < high ? low : high, to = low < high ? high : low;
        if (from > t[0]) t[0] = from;
        if (to < t[1]) t[1] = to;
    }
    return t[0] < t[1];
}

static void add_vertex(struct cutter *c, const double a[3], const double b[3], double t)
{
    for (size_t k = 0; k < 3 && c->tile != NULL; k++)
        c->tile->position_m[3 * c->n_vertex + k] = (float)(a[k] + t * (b[k] - a[k]));
    c->n_vertex++;
    c->n_run++;
}

static void end_run(struct cutter *c, size_t i_fiber)
{
    if (c->n_run == 0) return;
    if (c->tile != NULL) {
        c->tile->radius_m[c->n_fiber] = c->f->radius_m[i_fiber];
        c->tile->group[c->n_fiber] = c->f->group[i_fiber];
        c->tile->axis_class[c->n_fiber] = c->f->axis_class[i_fiber];
        c->tile->first_vertex[c->n_fiber + 1] = c->n_vertex;
    }
    c->n_fiber++;
    c->n_run = 0;
}

static void cut(struct cutter *c)
{
    c->n_fiber = c->n_vertex = c->n_run = 0;
    for (size_t l = 0; l < c->f->n_fiber; l++) {
        for (size_t i = c->f->first_vertex[l]; i + 1 < c->f->first_vertex[l + 1]; i++) {
            double a[3], b[3], t[2];
            vertex_of(c, i, a);
            vertex_of(c, i + 1, b);
            if (!clip(c, a, b, t)) {
                end_run(c, l);
                continue;
            }
            if (t[0] > 0.0) end_run(c, l);
            if (c->n_run == 0) add_vertex(c, a, b, t[0]);
            add_vertex(c, a, b, t[1]);
            if (t[1] < 1.0) end_run(c, l);
        }
        end_run(c, l);
    }
}

void cut_tile(const struct fiber_set *f, const double size_m[2], double skew, struct fiber_set *tile)
{
    struct cutter c = {.f = f, .size_m = size_m, .skew = skew};
    cut(&c);
    assert_int_equal(fiber_set_reserve(tile, c.n_fiber, c.n_vertex, NULL), STATUS_OK);
    memcpy(tile->tile_size_m, size_m, sizeof tile->tile_size_m);
    c.tile = tile;
    cut(&c);
}
