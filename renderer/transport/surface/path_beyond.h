/* The light that a camera ray meets after it has left the cloth without a hit. */
#ifndef SELVEDGE_RENDERER_PATH_BEYOND_H
#define SELVEDGE_RENDERER_PATH_BEYOND_H

#include "renderer/transport/surface/path_tracer.h"

/* Adds the radiance of lamp and environments along the ray; of the black sheet, nothing. */
static inline void path_add_beyond(const struct path_setting *s, const struct scene_ray *ray, float radiance[3])
{
    float position[3], beyond[3] = {0, 0, 0};
    if (s->lights.unseen || scene_sheet_met(s->scene, ray)) return;
    for (int a = 0; a < 3; a++) position[a] = (float)((double)ray->origin_mm[a] + (a < 2 ? ray->offset_mm[a] : 0.0));
    lights_add_environment(&s->lights, ray->direction, 0, beyond);
    float lamp = s->lights.has_lamp ? lights_lamp_beyond(&s->lights.lamp, position, ray->direction, 0) : 0;
    for (int c = 0; c < 3; c++) radiance[c] += lamp + beyond[c];
}

#endif
