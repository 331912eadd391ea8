/* Meshes of simple shapes, with the cloth laid on them without stretching. */
#ifndef SELVEDGE_RENDERER_MESH_SHAPES_H
#define SELVEDGE_RENDERER_MESH_SHAPES_H

#include "renderer/mesh/mesh.h"

/* A rectangle in the plane z = 0 with its middle at the origin; size_mm along x and y, n_cell cells a side.
 * STATUS_INVALID for a size that is not positive and for no cells. */
status mesh_flat(const double size_mm[2], const size_t n_cell[2], struct mesh *m, struct error *err);

/* A piece of the upper side of a cylinder: axis parallel to y, highest line through the origin, from -angle_rad to
 * +angle_rad around the axis (at most pi), n_cell cells around it and one along it. Seen from above, the weft (u) runs
 * around the cylinder. STATUS_INVALID as above. */
status mesh_cylinder(double radius_mm, double length_mm, double angle_rad, size_t n_cell, struct mesh *m,
                     struct error *err);

#endif
