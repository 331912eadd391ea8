/* Lines whose ends are partners become one line, which is cut where it crosses the faces of the large tile. */
#ifndef SELVEDGE_GEOMETRY_TILE_CHAINS_H
#define SELVEDGE_GEOMETRY_TILE_CHAINS_H

#include "geometry/fibers/tiles/tile_ends.h"

/* out: initialised by tile_lines_init. STATUS_NO_MEMORY. */
status tile_chains_make(const struct tile_ends *e, const struct tile_lines *l, struct tile_lines *out,
                        struct error *err);

#endif
