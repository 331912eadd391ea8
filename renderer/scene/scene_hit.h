/* Hits of rays with the flat cloth. Inside of struct scene. */
#ifndef SELVEDGE_RENDERER_SCENE_HIT_H
#define SELVEDGE_RENDERER_SCENE_HIT_H

#include "renderer/scene/scene_data.h"

/* Describes a face that a ray meets. The ray's frame moves to the copy of the tile that was hit. */
void scene_hit_fill(const struct scene *s, struct scene_ray *r, const struct scene_face *face, struct scene_hit *hit);

#endif
