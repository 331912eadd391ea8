/* Pieces of polylines that do not run along the measured fiber directions are cut out: chains that hop from fiber to fiber, or
 * take a row of touching sections for a fiber. */
#ifndef SELVEDGE_GEOMETRY_DISAGREEMENT_H
#define SELVEDGE_GEOMETRY_DISAGREEMENT_H

#include "geometry/fibers/lines/polyline.h"
#include "geometry/volume/volume.h"

/* Vertices where the angle between line and direction volume, averaged (mean squared sine) over nine vertices, exceeds max_angle_rad are
 * removed; what remains of a line goes to result (initialised, empty) in pieces of at least min_vertex. *n_cut: vertices removed. STATUS_NO_MEMORY. */
status polylines_cut_disagreeing(const struct polyline_set *lines, const struct direction_volume *d,
                                 double max_angle_rad, size_t min_vertex, struct polyline_set *result, size_t *n_cut,
                                 struct error *err);
/* Only the ends: from each end of a line up to the last such vertex that is within `reach` vertices of it. STATUS_NO_MEMORY. */
status polylines_trim_disagreeing(const struct polyline_set *lines, const struct direction_volume *d,
                                  double max_angle_rad, size_t reach, size_t min_vertex, struct polyline_set *result,
                                  size_t *n_cut, struct error *err);

#endif
