/* Embree's trees over fibers with elliptical sections (scene_ellipse.h), one tile instanced in a block. Inside of
 * struct scene. */
#ifndef SELVEDGE_RENDERER_SCENE_EMBREE_H
#define SELVEDGE_RENDERER_SCENE_EMBREE_H

#include "renderer/scene/scene_data.h"

struct scene_visitor;

/* STATUS_UNSUPPORTED, STATUS_NO_MEMORY. */
status scene_embree_build(struct scene *s, struct error *err);
void scene_embree_free(struct scene *s);
/* As scene_grid_trace; visitor NULL: as scene_grid_occluded, otherwise as scene_grid_visit. */
bool scene_embree_trace(const struct scene *s, const struct scene_ray *r, float t_far, struct scene_face *face);
bool scene_embree_occluded(const struct scene *s, const struct scene_ray *r, float t_far,
                           struct scene_visitor *visitor);

#endif
