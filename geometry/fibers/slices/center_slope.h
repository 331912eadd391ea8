/* The slope of a fiber's axis at a center, by the directions of its voxels. */
#ifndef SELVEDGE_GEOMETRY_CENTER_SLOPE_H
#define SELVEDGE_GEOMETRY_CENTER_SLOPE_H

#include "geometry/fibers/slices/center.h"

/* Whether a center lies in the volume and has a voxel of the class within one pixel. */
bool center_has_voxel(const struct center_search *s, size_t i_slice, const struct center *c);
/* Computes the mean direction of the class's voxels within one pixel of a center, as slopes. Returns false if it has
 * none. */
bool center_find_slope(const struct center_search *s, size_t i_slice, struct center *c);

#endif
