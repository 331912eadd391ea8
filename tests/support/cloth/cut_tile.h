/* A tile that is cut out of a larger cloth, as a scan is: its fibers end at the faces where they happen to. */
#ifndef SELVEDGE_TESTS_CUT_TILE_H
#define SELVEDGE_TESTS_CUT_TILE_H

#include "geometry/fibers/fiber_set.h"

/* tile (initialised) becomes what f has within 0 .. size_m in x and y, displaced by `skew` times x in y before the cut.
 * Pieces of fewer than two vertices are left out. Aborts the test when memory is out. */
void cut_tile(const struct fiber_set *f, const double size_m[2], double skew, struct fiber_set *tile);

#endif
