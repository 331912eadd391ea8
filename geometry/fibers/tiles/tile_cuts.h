/* The cuts between the blocks of a large tile (fiber_tiles.h): cuts of least difference between what two blocks show,
 * found by dynamic programming. Cuts between rows run along x over all of the tile, those between blocks of a row along
 * y. Metres. */
#ifndef SELVEDGE_GEOMETRY_TILE_CUTS_H
#define SELVEDGE_GEOMETRY_TILE_CUTS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/tiles/tile_view.h"

#include <stdbool.h>

struct tile_cuts {
    size_t n;            /* blocks a side */
    double tile_m[2];    /* of a block */
    double (*move_m)[2]; /* [row][column]: the block shows the place p + move of the tile at p */
    float *row;          /* [row][n x TILE_VIEW_EDGE + 1]: y of the lower cut over the row's own edge, along x */
    float *column;       /* [row][column][TILE_CUT_NODES]: x of the left cut over the block's own edge, along y */
};

/* Cuts leave the edges of blocks by at most this share of a block, and cuts of columns reach as far beyond the row. */
#define TILE_CUT_REACH 0.125
enum { TILE_CUT_NODES = TILE_VIEW_EDGE + 2 * (TILE_VIEW_EDGE / 8) + 1 };

/* Draws a move for each of n x n blocks, none like the block's left or lower neighbour where there are three or more,
 * and finds the cuts. STATUS_NO_MEMORY. Release in any case. */
status tile_cuts_make(struct tile_cuts *c, const struct tile_view *v, size_t n, double (*move_m)[2], size_t n_move,
                      uint64_t seed, struct error *err);
void tile_cuts_release(struct tile_cuts *c);
/* Whether a place belongs to a block. Places and blocks are not wrapped around the large tile. */
bool tile_cuts_inside(const struct tile_cuts *c, size_t i_row, size_t i_column, const double p_m[2]);

#endif
