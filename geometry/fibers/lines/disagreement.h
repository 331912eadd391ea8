/* Removes pieces of polylines that do not run along the measured fiber directions: chains that jump between fibers,
 * or that follow a row of touching sections. */
#ifndef SELVEDGE_GEOMETRY_DISAGREEMENT_H
#define SELVEDGE_GEOMETRY_DISAGREEMENT_H

#include "base/thread_pool.h"
#include "geometry/fibers/polyline.h"
#include "geometry/volume/volume.h"

/* pool NULL: one thread. */
struct disagreement_option {
    double max_angle_rad;
    size_t reach; /* vertices from the ends of a line that are trimmed */
    size_t min_vertex;
    struct thread_pool *pool;
    double overlap; /* share of the sum of the radii within which another line passes; 0: 0.9 */
};

/* Removes the vertices where the angle between line and direction volume, averaged over nine vertices (mean squared
 * sine), exceeds max_angle_rad, and that another line passes within `overlap`. (The direction volume
 * alone is not sure enough: where fibers are crowded or thin its own errors reach max_angle_rad.) The remaining pieces
 * of at least min_vertex vertices go to result (initialised, empty). *n_cut: number of vertices removed.
 * STATUS_NO_MEMORY. */
status polylines_cut_disagreeing(const struct polyline_set *lines, const struct direction_volume *d,
                                 const struct disagreement_option *o, struct polyline_set *result, size_t *n_cut,
                                 struct error *err);
/* The same only at the ends: removes from each end of a line up to the last such vertex within `reach` vertices of it.
 * STATUS_NO_MEMORY. */
status polylines_trim_disagreeing(const struct polyline_set *lines, const struct direction_volume *d,
                                  const struct disagreement_option *o, struct polyline_set *result, struct error *err);

#endif
