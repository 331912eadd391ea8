/* Hits of rays with the flat cloth. Inside of struct scene. */
#ifndef SELVEDGE_RENDERER_SCENE_HIT_H
#define SELVEDGE_RENDERER_SCENE_HIT_H

#include "renderer/scene/scene_data.h"

/* Describes what Embree has found for a ray. The ray's frame moves to the copy of the tile that was hit. */
void scene_hit_fill(const struct scene *s, struct scene_ray *r, const struct RTCRayHit *q, struct scene_hit *hit);

#endif
