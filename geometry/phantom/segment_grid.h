/* Finds the nearest point on the polylines of a fiber set, periodic in x and y. Built once, then used by any number
 * of threads. */
#ifndef SELVEDGE_GEOMETRY_SEGMENT_GRID_H
#define SELVEDGE_GEOMETRY_SEGMENT_GRID_H

#include "geometry/fibers/fiber_set.h"

#include <stdbool.h>

struct segment_grid;

struct segment_hit {
    double distance_m;
    size_t i_fiber, i_vertex; /* segment i_vertex .. i_vertex + 1 */
    double t;                 /* position on the segment, 0..1 */
    double direction[3];      /* unit vector */
};

/* reach_m: the largest distance that will be requested. f must outlive the grid. STATUS_NO_MEMORY. */
status segment_grid_new(const struct fiber_set *f, const double tile_m[2], double reach_m, struct segment_grid **grid,
                        struct error *err);
void segment_grid_free(struct segment_grid *grid);
/* Returns false if nothing lies within limit_m (at most reach_m). */
bool segment_grid_nearest(const struct segment_grid *grid, const double p_m[3], double limit_m,
                          struct segment_hit *hit);

#endif
