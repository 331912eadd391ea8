/* The discrepancy of a cloth (renderer/transport/discrepancy.h) on the light of one path: inside of path_tracer.c. */
#ifndef SELVEDGE_RENDERER_PATH_DISCREPANCY_H
#define SELVEDGE_RENDERER_PATH_DISCREPANCY_H

#include "renderer/transport/surface/path_walk.h"

/* Remembers what the discrepancy needs of the present bounce. */
static inline void path_discrepancy_note(struct walk *w, const struct bounce *b, const struct scene_ray *ray)
{
    memcpy(w->normal, b->normal, sizeof w->normal);
    if (w->first_out->n_bounce > 1) return;
    for (int a = 0; a < 3; a++) w->to_camera[a] = -ray->direction[a];
    w->cos_camera = fiber_frame_dot(w->to_camera, b->normal);
}

/* Multiplies light that reaches the path from a direction by the factor. What the camera sees beside the cloth has
 * none. */
static inline void path_discrepancy_apply(const struct walk *w, const float normal[3], const float direction[3],
                                          float value[3])
{
    double factor[3];
    if (w->s->discrepancy == NULL || w->first_out->n_bounce == 0) return;
    discrepancy_factor(w->s->discrepancy, fiber_frame_dot(direction, normal), w->cos_camera,
                       fiber_frame_dot(direction, w->to_camera), factor);
    for (int c = 0; c < 3; c++) value[c] *= (float)factor[c];
}

#endif
