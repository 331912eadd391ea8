/* Extends free ends of polylines along their fiber, through material that belongs to no other polyline.
 *
 * A step is one voxel along the tangent, followed by a move to the centroid of the material that is nearer to this
 * line than to any other, perpendicular to the tangent. The walk ends where the material ends, at another line, at a
 * face of the volume, or after max_step steps. It closes gaps that slices leave: fibers at 45 degrees to two axes,
 * sharp bends, ends near faces. */
#ifndef SELVEDGE_GEOMETRY_GROWING_H
#define SELVEDGE_GEOMETRY_GROWING_H

#include "geometry/fibers/polyline.h"
#include "geometry/volume/volume.h"

struct grow_option {
    float diameter_voxel;
    float eps_d;  /* mean density around the axis that counts as fiber */
    int max_step; /* voxels per end */
};

/* Writes the extended lines to result (initialised, empty). *n_grown: number of vertices added. STATUS_NO_MEMORY. */
status polylines_grow(const struct polyline_set *lines, const struct volume *v, const struct grow_option *o,
                      struct polyline_set *result, size_t *n_grown, struct error *err);

#endif
