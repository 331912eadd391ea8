/* The nodes of strands sorted by the cells of a periodic grid, so that the neighbours of a node are found at once.
 * Cells are at least a diameter wide: nodes that touch lie in the same cell or in neighbouring ones. Nodes of a cell
 * lie side by side in memory with the numbers that the test of a pair needs, because pairs are looked at more often
 * than anything else. */
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
    /* Coordinates of the sorted nodes, moved into the tile in x and y; LANES more of each can be read. A float is off
     * by at most rounding_m. */
    float *at[3];
    int32_t *node; /* of the sorted nodes, as many */
    double rounding_m, most_radius_m;
    uint32_t *cell_of; /* node -> cell */
};

/* Makes room for the nodes of s, which may leave the space between their starts by 4 radii. STATUS_NO_MEMORY; release
 * it then, too. */
status strand_grid_init(struct strand_grid *g, const struct strand_set *s, struct error *err);
void strand_grid_release(struct strand_grid *g);

/* Sorts the nodes by their present places. strand_of: node -> strand. */
void strand_grid_sort(struct strand_grid *g, const struct strand_set *s, const uint32_t *strand_of);

/* A row of cells along x, each row by its number among n_cell[1] * n_cell[2] of them, and the shift of y that puts its
 * nodes beside the nodes of another row. */
struct grid_row {
    size_t first_cell;
    float shift_m;
};
enum { GRID_MAX_ROW = 9, GRID_MAX_RUN = 27 };

/* Rows around a row, itself included, each row once. Returns their number. */
size_t strand_grid_rows(const struct strand_grid *g, size_t i_row, struct grid_row row[GRID_MAX_ROW]);

/* A run of neighbouring cells: sorted[from] to sorted[to - 1], and the shift of their x and y. */
struct grid_run {
    uint32_t from, to;
    float shift_m[2];
};

/* Runs of the cells around cell at_x of a row, itself included, each cell once. Returns their number. row: those around
 * its row. */
size_t strand_grid_runs(const struct strand_grid *g, const struct grid_row *row, size_t n_row, size_t at_x,
                        struct grid_run run[GRID_MAX_RUN]);

/* Whether the tile has so few cells that a node and its neighbour can lie beside each other in two ways. The shifts of
 * rows and runs are then only one of them. */
bool strand_grid_is_narrow(const struct strand_grid *g);

#endif
