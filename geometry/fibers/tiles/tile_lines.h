/* Growing polylines with sections, for the files of this folder. Metres. */
#ifndef SELVEDGE_GEOMETRY_TILE_LINES_H
#define SELVEDGE_GEOMETRY_TILE_LINES_H

#include "geometry/fibers/fiber_set.h"

struct tile_vertex {
    double p[3];
    struct fiber_shape shape;
};

struct tile_lines {
    size_t n_line, n_vertex, line_room, vertex_room;
    size_t *first;              /* n_line + 1 */
    size_t *source;             /* of each line: a fiber of the tile that it was cut from */
    bool (*is_cut)[2];          /* of each line: whether its first and its last end were made by a cut */
    struct tile_vertex *vertex; /* n_vertex */
};

/* No lines. STATUS_NO_MEMORY. Release in any case. */
status tile_lines_init(struct tile_lines *l, struct error *err);
void tile_lines_release(struct tile_lines *l);
/* Adds a vertex to the line that is not finished yet. STATUS_NO_MEMORY. */
status tile_lines_add(struct tile_lines *l, const struct tile_vertex *v, struct error *err);
/* Finishes a line; one of fewer than two vertices is dropped. STATUS_NO_MEMORY. */
status tile_lines_end(struct tile_lines *l, size_t source, bool first_is_cut, bool last_is_cut, struct error *err);
/* Makes the lines the fibers of f, with radii, groups and classes of their sources, and sections if f has some. f is
 * unchanged on failure. STATUS_NO_MEMORY. */
status tile_lines_take(const struct tile_lines *l, const double tile_m[2], struct fiber_set *f, struct error *err);

#endif
