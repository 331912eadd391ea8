/* The surfaces of films that a camera sees from near, and places on them. */
#ifndef SELVEDGE_RENDERER_SCENE_GLINT_H
#define SELVEDGE_RENDERER_SCENE_GLINT_H

#include "renderer/glint/glint_surface.h"
#include "renderer/glint/wave_glint.h"
#include "renderer/scene/scene_ray.h"

/* Makes the surfaces of all films of the scene that have glints, once; any thread may call it. STATUS_NO_MEMORY. */
status scene_glints_make(const struct scene *scene, struct error *err);
/* The surface of the film that was hit, after scene_glints_make, and the place of the hit on it: along the film and
 * across it, in micrometres. Each film has another place of the map at its begin, also in each copy of the tile.
 * NULL: it has no glints. */
const struct glint_surface *scene_glint_at(const struct scene *scene, const struct scene_hit *hit,
                                           const double offset_mm[2], float place_um[2]);
/* The height field of the film that was hit; NULL: it reflects by geometric optics. Places are as on its surface. */
const struct wave_glint *scene_glint_waves(const struct scene *scene, const struct scene_hit *hit);

#endif
