/* What a tile shows from above, on a grid of cells, and the moves by which it looks like itself. */
#ifndef SELVEDGE_GEOMETRY_TILE_VIEW_H
#define SELVEDGE_GEOMETRY_TILE_VIEW_H

#include "geometry/fibers/fiber_set.h"

enum { TILE_VIEW_EDGE = 64, TILE_VIEW_CHANNELS = 4, TILE_VIEW_MOST_MOVES = 32 };

struct tile_view {
    /* [y][x]: length of fibers, the same times height, and along x and y, each with the mean 0 and the variance 1 */
    float at[TILE_VIEW_EDGE][TILE_VIEW_EDGE][TILE_VIEW_CHANNELS];
    double tile_m[2];
};

void tile_view_make(struct tile_view *v, const struct fiber_set *f);
/* Squared difference of the cells at two places, in metres, which may lie outside of the tile. */
double tile_view_difference(const struct tile_view *v, const double a_m[2], const double b_m[2]);
/* Finds moves after which the tile looks like itself: local minima of the mean difference, below 0.7 of its mean over
 * all moves and before the widest step of their differences, at least an eighth of the tile apart, at most
 * TILE_VIEW_MOST_MOVES. The first is the zero move. Returns how many there are. */
size_t tile_view_moves(const struct tile_view *v, double move_m[TILE_VIEW_MOST_MOVES][2]);

#endif
