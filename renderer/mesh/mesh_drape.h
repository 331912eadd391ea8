/* A piece of cloth that has fallen over a ball, by extended position-based dynamics with small steps (Macklin et al.
 * 2016, "XPBD"; 2019, "Small steps in physics simulation").
 */
#ifndef SELVEDGE_RENDERER_MESH_DRAPE_H
#define SELVEDGE_RENDERER_MESH_DRAPE_H

#include "base/progress.h"
#include "renderer/mesh/mesh.h"

/* A square piece with edges of size_mm at rest on a ball of radius_mm, over which its middle lay when it began to fall.
 * Weft (u) and warp (v) hardly stretch, the angle between them gives way; the cloth's bending length (Peirce 1930) is
 * 0.08 of its size, so that the shape depends on radius_mm / size_mm alone, and the mesh for another size is the same
 * one scaled. The origin is the middle of its bounding box, z is up. The same numbers give the same bits. Takes about
 * five seconds. STATUS_INVALID: lengths that are not positive, a radius below 0.02 or above 10 times the size, and
 * a shape in which folds touch; STATUS_NO_MEMORY, STATUS_CANCELLED. */
status mesh_drape(double size_mm, double radius_mm, const struct progress *progress, struct mesh *m, struct error *err);

#endif
