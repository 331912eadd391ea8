/* A large tile without a visible repeat from a tile that holds several repeats of a weave: n x n blocks, each of which
 * shows the tile moved by another whole number of repeats, joined along cuts of least error.
 *
 * The fabric thesis (5.7.1) makes Wang tiles (Cohen et al. 2003) of volumes; cuts by dynamic programming are those of
 * image quilting (Efros and Freeman 2001). Here each block draws its own move, and not one of a few edge colors, and
 * fibers are joined in place of voxels: ends at a cut are paired by the assignment of least cost, in three rounds
 * within 10, 25 and 60 radii, moved to their midpoint and turned to their mean direction, which fades out along the
 * fiber as in fiber_seam.h. The large tile is periodic. */
#ifndef SELVEDGE_GEOMETRY_FIBER_TILES_H
#define SELVEDGE_GEOMETRY_FIBER_TILES_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/tiles/tile_figures.h"

enum { FIBER_TILES_MAX = 16, FIBER_TILES_MAX_VERTEX = 40000000 };

/* Replaces f by n x n blocks of it, n <= FIBER_TILES_MAX. Ends at its faces should be joined (fiber_seam_join). f must
 * satisfy fiber_set_validate. STATUS_TOO_LARGE above FIBER_TILES_MAX_VERTEX vertices, STATUS_NO_MEMORY; f is then
 * unchanged. */
status fiber_tiles_make(struct fiber_set *f, size_t n, uint64_t seed, struct fiber_tiles *tiles, struct error *err);

#endif
