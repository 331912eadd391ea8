/* The ends of the pieces of a large tile, and their partners: those that meet as they are, and those that a cut has
 * made, by the assignment of least cost. */
#ifndef SELVEDGE_GEOMETRY_TILE_ENDS_H
#define SELVEDGE_GEOMETRY_TILE_ENDS_H

#include "geometry/fibers/tiles/tile_figures.h"
#include "geometry/fibers/tiles/tile_lines.h"

/* The end 2 i of a line i is its first vertex, 2 i + 1 its last. */
struct tile_end {
    double p[3], t[3]; /* t: unit, outwards */
    double radius;
    uint8_t group;
    bool is_cut;
};

struct tile_ends {
    size_t n;
    struct tile_end *end;
    size_t *partner;  /* SIZE_MAX: none */
    double tile_m[2]; /* of the large tile */
};

/* Finds the partners. f: the tile that lines were cut from. Sets n_cut_end and n_free of `tiles`. STATUS_NO_MEMORY.
 * Release in any case. */
status tile_ends_make(struct tile_ends *e, const struct tile_lines *l, const struct fiber_set *f,
                      const double tile_m[2], struct fiber_tiles *tiles, struct error *err);
void tile_ends_release(struct tile_ends *e);
/* From the end i to the nearest copy of the end k. */
void tile_ends_between(const struct tile_ends *e, size_t i, size_t k, double d[3]);
/* Moves the pairs of cut ends to their midpoints and mean directions (fiber_tiles.h). Sets move_m. */
void tile_ends_join(const struct tile_ends *e, struct tile_lines *l, struct fiber_tiles *tiles);

#endif
