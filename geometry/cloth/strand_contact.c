/* The search compares floats, LANES nodes at a time, with a reach widened by the largest rounding error. Each pair
 * found is tested again in double precision, in the order of the grid, so that results do not depend on the number of
 * SIMD lanes. */
#include "geometry/cloth/strand_contact.h"
#include "base/lanes.h"

#include <math.h>

/* Nodes that are near each other along one strand belong to one fiber and do not push each other apart. Nodes are a
 * radius apart, so this is longer than a half circle of radius 2 r. */
enum { SAME_FIBER = 8 };

/* Whether two nodes of a closed strand are near each other where it meets itself. */
static bool meet(const struct strand *t, const struct grid_node *a, const struct grid_node *b)
{
    size_t gap = a->node > b->node ? a->node - b->node : b->node - a->node;
    return t->n_period > 0 && t->n - gap < SAME_FIBER;
}

enum { BATCH = 256 };

/* Pairs of nodes that are near each other, worked on together so that the compiler makes vectors of pairs. */
struct batch {
    size_t n;
    uint32_t node[BATCH];                /* that is pushed */
    double d_m[3][BATCH], want_m[BATCH]; /* from the other node; sum of radii */
    double aside[BATCH];                 /* where it goes in z when both are in one place */
    /* results: the terms to add, 0 for pairs that do not touch */
    double move_m[3][BATCH], n_contact[BATCH], depth[BATCH];
};

/* A row of cells whose nodes look for their contacts. */
struct look {
    const struct strand_contacts *c;
    struct strand_push *push;
    struct batch batch;
};

/* Takes vectors to the nearest one of all tiles. */
static void wrap(double *restrict d_m, size_t n, double tile_m)
{
    const double per_tile = 1.0 / tile_m;
    for (size_t k = 0; k < n; k++) d_m[k] -= tile_m * rint(d_m[k] * per_tile);
}

/* Contacts without a step at first touch, and without a sudden turn when centres pass each other. */
static void push_smoothly(struct batch *restrict b)
{
    static const double full = 0.1, blunt = 0.2; /* of the sum of radii */
    for (size_t k = 0; k < b->n; k++) {
        double x = b->d_m[0][k], y = b->d_m[1][k], z = b->d_m[2][k], want = b->want_m[k];
        double d2 = x * x + y * y + z * z, distance = sqrt(d2), depth = want - distance;
        double share = depth / (full * want), length = sqrt(distance * distance + blunt * blunt * want * want);
        share = share < 1.0 ? share : 1.0;
        bool touches = d2 < want * want;
        double by = touches ? 0.5 * depth : 0.0;
        b->move_m[0][k] = by * x / length;
        b->move_m[1][k] = by * y / length;
        b->move_m[2][k] = by * z / length;
        b->n_contact[k] = touches ? share * share * (3.0 - 2.0 * share) : 0.0;
        b->depth[k] = touches ? depth / want : 0.0;
    }
}

/* Contacts that all count alike. */
static void push_by_steps(struct batch *restrict b)
{
    for (size_t k = 0; k < b->n; k++) {
        double x = b->d_m[0][k], y = b->d_m[1][k], z = b->d_m[2][k], want = b->want_m[k];
        double d2 = x * x + y * y + z * z, distance = sqrt(d2), depth = want - distance;
        bool touches = d2 < want * want, one_place = distance < 1e-9 * want;
        double by = touches ? 0.5 * depth : 0.0, length = one_place ? 1.0 : distance;
        b->move_m[0][k] = by * (one_place ? 0.0 : x) / length;
        b->move_m[1][k] = by * (one_place ? 0.0 : y) / length;
        b->move_m[2][k] = by * (one_place ? b->aside[k] : z) / length;
        b->n_contact[k] = touches ? 1.0 : 0.0;
        b->depth[k] = touches ? depth / want : 0.0;
    }
}

/* Adds the contacts of the batch to their nodes, in their order, and empties it. */
static void push_batch(struct look *l)
{
    struct batch *b = &l->batch;
    for (int a = 0; a < 2; a++) wrap(b->d_m[a], b->n, l->c->s->tile_m[a]);
    if (l->c->rule == STRAND_SMOOTH)
        push_smoothly(b);
    else
        push_by_steps(b);
    for (size_t k = 0; k < b->n; k++) {
        struct strand_push *to = &l->push[b->node[k]];
        double *depth = &l->c->depth[b->node[k]];
        for (int a = 0; a < 3; a++) to->sum_m[a] += b->move_m[a][k];
        to->n_contact += b->n_contact[k];
        *depth = *depth > b->depth[k] ? *depth : b->depth[k];
    }
    b->n = 0;
}

/* Adds a pair that is near enough to touch. */
static inline void add_pair(struct look *l, const struct grid_node *i, const struct grid_node *j)
{
    struct batch *b = &l->batch;
    if (i->strand == j->strand && meet(&l->c->s->strand[i->strand], i, j)) return;
    if (b->n == BATCH) push_batch(l);
    const size_t k = b->n++;
    b->node[k] = i->node;
    for (int a = 0; a < 3; a++) b->d_m[a][k] = i->p[a] - j->p[a];
    b->want_m[k] = i->radius_m + j->radius_m;
    b->aside[k] = i->node < j->node ? -1.0 : 1.0; /* the lower number goes down */
}

/* Up to LANES sorted nodes beside each other, the shift of their x and y, and a bit for each. */
struct piece {
    uint32_t from, valid;
    float shift_m[2];
};
enum { MOST_PIECES = 64, PIECES_PER_WORD = 64 / LANES };

/* Finds the nodes of some pieces that are near sorted node k. */
static void look_from(struct look *l, size_t k, const struct piece *piece, size_t n_piece)
{
    const struct strand_grid *g = l->c->grid;
    const struct grid_node *own = &g->sorted[k];
    const struct strand *t = &l->c->s->strand[own->strand];
    if (t->fixed) return; /* contacts do not move it */
    const double reach_m = own->radius_m + g->most_radius_m + 8.0 * g->rounding_m;
    const float x = g->at[0][k], y = g->at[1][k], z = g->at[2][k],
                reach2 = strand_grid_is_narrow(g) ? INFINITY : (float)(reach_m * reach_m);
    const int32_t begin = (int32_t)t->first, end = begin + (int32_t)t->n, node = g->node[k];
    /* nodes low to high are too near along the strand */
    const int32_t low = node - begin < SAME_FIBER ? begin : node - SAME_FIBER + 1,
                  high = end - node <= SAME_FIBER ? end - 1 : node + SAME_FIBER - 1;
    for (size_t i = 0; i < n_piece; i += PIECES_PER_WORD) {
        const struct piece *in = piece + i;
        size_t n = n_piece - i < PIECES_PER_WORD ? n_piece - i : PIECES_PER_WORD;
        uint64_t near = 0; /* LANES bits of each piece, so that one loop runs over the nodes found in all */
        for (size_t q = 0; q < n; q++) {
            const size_t from = in[q].from;
            const lanes d_x = *(const lanes *)(g->at[0] + from) - (x - in[q].shift_m[0]),
                        d_y = *(const lanes *)(g->at[1] + from) - (y - in[q].shift_m[1]),
                        d_z = *(const lanes *)(g->at[2] + from) - z;
            const lane_mask other = *(const lane_mask *)(g->node + from);
            const lane_mask found = (d_x * d_x + d_y * d_y + d_z * d_z < reach2) & ((other < low) | (other > high));
            near |= (uint64_t)(lanes_bits(found) & in[q].valid) << (LANES * q);
        }
        for (; near != 0; near &= near - 1) {
            const unsigned bit = (unsigned)__builtin_ctzll(near);
            add_pair(l, own, g->sorted + in[bit / LANES].from + bit % LANES);
        }
    }
}

/* Looks from the sorted nodes from - to. row: those around their row. */
static void look_from_cell(struct look *l, const struct grid_row *row, size_t n_row, size_t at_x, uint32_t from,
                           uint32_t to)
{
    const struct strand_grid *g = l->c->grid;
    struct grid_run run[GRID_MAX_RUN];
    struct piece piece[MOST_PIECES];
    const size_t n_run = strand_grid_runs(g, row, n_row, at_x, run);
    size_t n = 0;
    for (uint32_t k = from; k < to; k++) {
        l->push[g->node[k]] = (struct strand_push){{0.0, 0.0, 0.0}, 0.0};
        l->c->depth[g->node[k]] = 0.0;
    }
    for (size_t i = 0; i < n_run; i++)
        for (uint32_t at = run[i].from; at < run[i].to; at += LANES) {
            const uint32_t rest = run[i].to - at, valid = rest < LANES ? (1u << rest) - 1u : (1u << LANES) - 1u;
            piece[n++] = (struct piece){at, valid, {run[i].shift_m[0], run[i].shift_m[1]}};
            if (n < MOST_PIECES) continue;
            for (uint32_t k = from; k < to; k++) look_from(l, k, piece, n);
            n = 0;
        }
    for (uint32_t k = from; k < to; k++) look_from(l, k, piece, n);
}

void strand_contacts_of_row(const struct strand_contacts *c, size_t i_row, struct strand_push *push)
{
    const struct strand_grid *g = c->grid;
    const size_t first_cell = i_row * g->n_cell[0];
    if (g->first[first_cell] == g->first[first_cell + g->n_cell[0]]) return;
    struct look l;
    l.c = c;
    l.push = push;
    l.batch.n = 0;
    struct grid_row row[GRID_MAX_ROW];
    const size_t n_row = strand_grid_rows(g, i_row, row);
    for (size_t x = 0; x < g->n_cell[0]; x++) {
        const uint32_t from = g->first[first_cell + x], to = g->first[first_cell + x + 1];
        if (from < to) look_from_cell(&l, row, n_row, x, from, to);
    }
    push_batch(&l);
}
