/* Lines that change over from one fiber to its neighbour do so in a few voxels: they bend away and back more sharply than fibers do.
 * How sharply fibers bend differs from cloth to cloth, so the limit is taken from the lines themselves. */
#ifndef SELVEDGE_GEOMETRY_KINKS_H
#define SELVEDGE_GEOMETRY_KINKS_H

#include "geometry/fibers/lines/polyline.h"

/* Turn per voxel of arc length that only kinks exceed: over_usual times what 95 % of the vertices stay below, and at least 1.2 radians a
 * diameter. STATUS_NO_MEMORY. */
status polylines_kink_limit(const struct polyline_set *lines, double diameter_voxel, double over_usual,
                            double *limit_per_voxel, struct error *err);

/* Vertices (about one a voxel) within half a diameter of a kink are removed; near the ends of a line 0.7 of the limit is enough. What remains
 * of a line goes to result (initialised, empty) in pieces of at least min_vertex. *n_cut: vertices removed. STATUS_NO_MEMORY. */
status polylines_cut_kinks(const struct polyline_set *lines, double diameter_voxel, double over_usual,
                           size_t min_vertex, struct polyline_set *result, size_t *n_cut, struct error *err);

#endif
