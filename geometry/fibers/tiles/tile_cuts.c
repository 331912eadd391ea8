#include "geometry/fibers/tiles/tile_cuts.h"
#include "base/rng.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { E = TILE_VIEW_EDGE, REACH = E / 8, WIDTH = 2 * REACH + 1 };

/* The path of least cost over n nodes with WIDTH places each, that changes by at most one place from node to node;
 * closed: it begins and ends at the middle. cost[n][WIDTH] becomes sums. */
static void find_path(double (*cost)[WIDTH], size_t n, bool closed, int *place)
{
    int at = REACH;
    for (int k = 0; k < WIDTH && closed; k++)
        if (k != REACH) cost[0][k] = INFINITY;
    for (size_t i = 1; i < n; i++)
        for (int k = 0; k < WIDTH; k++) {
            double least = cost[i - 1][k];
            if (k > 0) least = fmin(least, cost[i - 1][k - 1]);
            if (k + 1 < WIDTH) least = fmin(least, cost[i - 1][k + 1]);
            cost[i][k] += least;
        }
    for (int k = 0; k < WIDTH && !closed; k++)
        if (cost[n - 1][k] < cost[n - 1][at]) at = k;
    for (size_t i = n; i-- > 0;) {
        place[i] = at;
        if (i == 0) break;
        int best = at;
        for (int k = at > 0 ? at - 1 : 0; k <= at + 1 && k < WIDTH; k++)
            if (cost[i - 1][k] < cost[i - 1][best]) best = k;
        at = best;
    }
}

static size_t left_of(const struct tile_cuts *c, size_t i) { return (i + c->n - 1) % c->n; }

/* Difference of what two blocks show at a place. */
static double differs(const struct tile_cuts *c, const struct tile_view *v, size_t block, size_t other, double x,
                      double y)
{
    const double a[2] = {x + c->move_m[block][0], y + c->move_m[block][1]},
                 b[2] = {x + c->move_m[other][0], y + c->move_m[other][1]};
    return tile_view_difference(v, a, b);
}

static void cut_column(struct tile_cuts *c, const struct tile_view *v, size_t row, size_t column, double (*cost)[WIDTH],
                       int *place)
{
    float *out = c->column + (row * c->n + column) * TILE_CUT_NODES;
    const double cell[2] = {c->tile_m[0] / E, c->tile_m[1] / E};
    for (size_t i = 0; i < TILE_CUT_NODES; i++)
        for (int k = 0; k < WIDTH; k++)
            cost[i][k] = differs(c, v, row * c->n + column, row * c->n + left_of(c, column),
                                 (double)column * c->tile_m[0] + (k - REACH) * cell[0],
                                 (double)row * c->tile_m[1] + ((double)i - REACH) * cell[1]);
    find_path(cost, TILE_CUT_NODES, false, place);
    for (size_t i = 0; i < TILE_CUT_NODES; i++) out[i] = (float)((place[i] - REACH) * cell[0]);
}

static float between(const float *node, size_t n, double at)
{
    const double x = fmin(fmax(at, 0.0), (double)(n - 1));
    const size_t i = x >= (double)(n - 1) ? n - 2 : (size_t)x;
    const float part = (float)(x - (double)i);
    return (1 - part) * node[i] + part * node[i + 1];
}

/* x of the left cut of a block of a row at a height over the row's own edge. */
static double left_cut(const struct tile_cuts *c, size_t row, size_t column, double y)
{
    return (double)between(c->column + (row * c->n + column % c->n) * TILE_CUT_NODES, TILE_CUT_NODES,
                           y / c->tile_m[1] * E + REACH);
}

/* The block of a row that holds a place. */
static size_t column_at(const struct tile_cuts *c, size_t row, double x, double y)
{
    for (size_t i = 0; i <= c->n; i++)
        if (x < (double)i * c->tile_m[0] + left_cut(c, row, i, y)) return i == 0 ? c->n - 1 : i - 1;
    return 0;
}

static void cut_row(struct tile_cuts *c, const struct tile_view *v, size_t row, double (*cost)[WIDTH], int *place)
{
    const size_t n_node = c->n * E + 1, under = left_of(c, row);
    const double cell[2] = {c->tile_m[0] / E, c->tile_m[1] / E};
    for (size_t i = 0; i < n_node; i++)
        for (int k = 0; k < WIDTH; k++) {
            const double x = (double)i * cell[0], y = (k - REACH) * cell[1];
            const size_t own = row * c->n + column_at(c, row, x, y),
                         other = under * c->n + column_at(c, under, x, y + c->tile_m[1]);
            cost[i][k] = differs(c, v, own, other, x, (double)row * c->tile_m[1] + y);
        }
    find_path(cost, n_node, true, place);
    for (size_t i = 0; i < n_node; i++) c->row[row * n_node + i] = (float)((place[i] - REACH) * cell[1]);
}

static void draw_moves(struct tile_cuts *c, double (*move_m)[2], size_t n_move, uint64_t seed)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = seed}, 0, 0);
    for (size_t i = 0; i < c->n * c->n; i++) {
        const size_t row = i / c->n, column = i % c->n;
        const double *left = column > 0 ? c->move_m[i - 1] : NULL, *under = row > 0 ? c->move_m[i - c->n] : NULL;
        const double *drawn;
        do {
            drawn = move_m[(size_t)(rng_double(&rng) * (double)n_move)];
        } while (n_move > 2 && ((left != NULL && memcmp(left, drawn, sizeof *move_m) == 0) ||
                                (under != NULL && memcmp(under, drawn, sizeof *move_m) == 0)));
        memcpy(c->move_m[i], drawn, sizeof *move_m);
    }
}

status tile_cuts_make(struct tile_cuts *c, const struct tile_view *v, size_t n, double (*move_m)[2], size_t n_move,
                      uint64_t seed, struct error *err)
{
    const size_t n_node = n * E + 1 > TILE_CUT_NODES ? n * E + 1 : TILE_CUT_NODES;
    double(*cost)[WIDTH] = malloc(n_node * sizeof *cost);
    int *place = malloc(n_node * sizeof *place);
    *c = (struct tile_cuts){.n = n, .tile_m = {v->tile_m[0], v->tile_m[1]}};
    c->move_m = calloc(n * n, sizeof *c->move_m);
    c->row = calloc(n * (n * E + 1), sizeof *c->row);
    c->column = calloc(n * n * TILE_CUT_NODES, sizeof *c->column);
    const bool enough = cost != NULL && place != NULL && c->move_m != NULL && c->row != NULL && c->column != NULL;
    if (enough) {
        draw_moves(c, move_m, n_move, seed);
        for (size_t i = 0; i < n * n; i++) cut_column(c, v, i / n, i % n, cost, place);
        for (size_t i = 0; i < n; i++) cut_row(c, v, i, cost, place);
    }
    free(cost);
    free(place);
    return enough ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
}

void tile_cuts_release(struct tile_cuts *c)
{
    free(c->move_m);
    free(c->row);
    free(c->column);
    memset(c, 0, sizeof *c);
}

/* y of the lower cut of a row. x: not wrapped. */
static double lower_cut(const struct tile_cuts *c, size_t row, double x)
{
    const double all = (double)c->n * c->tile_m[0], along = x - floor(x / all) * all;
    return (double)between(c->row + (row % c->n) * (c->n * E + 1), c->n * E + 1, along / c->tile_m[0] * E);
}

bool tile_cuts_inside(const struct tile_cuts *c, size_t i_row, size_t i_column, const double p[2])
{
    const double y = p[1] - (double)i_row * c->tile_m[1];
    if (y < lower_cut(c, i_row, p[0]) || y >= c->tile_m[1] + lower_cut(c, i_row + 1, p[0])) return false;
    return p[0] >= (double)i_column * c->tile_m[0] + left_cut(c, i_row, i_column, y) &&
           p[0] < (double)(i_column + 1) * c->tile_m[0] + left_cut(c, i_row, i_column + 1, y);
}
