/* The nodes of strands sorted by the cells of a periodic grid, so that the neighbours of a node are found at once.
 * Cells are at least a diameter wide: nodes that touch lie in the same cell or in neighbouring ones. Nodes of a cell
 * lie side by side in memory with what a pair of them needs, because pairs are looked at more often than anything
 * else. */
#ifndef SELVEDGE_GEOMETRY_STRAND_GRID_H
#define SELVEDGE_GEOMETRY_STRAND_GRID_H

#include "geometry/cloth/strand.h"

struct grid_node {
    double p[3], radius_m;
    uint32_t node, strand;
};

struct strand_grid {
    size_t n_cell[3];
    double cell_m[3], z_low_m;
    uint32_t *first; /* of cell c: sorted[first[c]] to sorted[first[c + 1] - 1], by the number of the node */
    struct grid_node *sorted;
    uint32_t *cell_of; /* node -> cell */
};

/* Makes room for the nodes of s, which may leave the space between their starts by 4 radii. STATUS_NO_MEMORY; release
 * it then, too. */
status strand_grid_init(struct strand_grid *g, const struct strand_set *s, struct error *err);
void strand_grid_release(struct strand_grid *g);

/* Sorts the nodes by their present places. strand_of: node -> strand. */
void strand_grid_sort(struct strand_grid *g, const struct strand_set *s, const uint32_t *strand_of);

/* A run of neighbouring cells: sorted[from] to sorted[to - 1]. */
struct grid_run {
    uint32_t from, to;
};
enum { GRID_MAX_RUN = 27 };

/* Runs of the cells around a cell, itself included, each cell once. Returns their number. */
size_t strand_grid_around(const struct strand_grid *g, uint32_t cell, struct grid_run run[GRID_MAX_RUN]);

#endif
