/* Removes kinks. A line that jumps from one fiber to its neighbour does so within a few voxels, and bends there more
 * sharply than fibers do. How sharply fibers bend differs from cloth to cloth, so the limit comes from the lines
 * themselves. */
#ifndef SELVEDGE_GEOMETRY_KINKS_H
#define SELVEDGE_GEOMETRY_KINKS_H

#include "geometry/fibers/polyline.h"

#include <stdbool.h>

/* Computes the turn per voxel of arc length that only kinks exceed: over_usual times the 95 % quantile over the
 * vertices, and at least 1.2 radians per diameter. STATUS_NO_MEMORY. */
status polylines_kink_limit(const struct polyline_set *lines, double diameter_voxel, double over_usual,
                            double *limit_per_voxel, struct error *err);

/* Removes the vertices (about one per voxel) within half a diameter of a kink, which growth and a fit replace, or with
 * only_sharpest one vertex for each kink; near the ends of a line the limit is 0.7 times as large. The remaining pieces
 * of at least min_vertex vertices go to result (initialised, empty). *n_cut: number of vertices removed.
 * STATUS_NO_MEMORY. */
status polylines_cut_kinks(const struct polyline_set *lines, double diameter_voxel, double over_usual,
                           size_t min_vertex, bool only_sharpest, struct polyline_set *result, size_t *n_cut,
                           struct error *err);

#endif
