/* Factors on the light of one path: the discrepancy of the cloth (renderer/transport/discrepancy.h), and the speckle of
 * fibers (renderer/scattering/speckle.h). Inside of path_steps.h.
 */
#ifndef SELVEDGE_RENDERER_PATH_FACTOR_H
#define SELVEDGE_RENDERER_PATH_FACTOR_H

#include "renderer/transport/surface/path_walk.h"

static inline bool path_factor_wanted(const struct path_setting *s)
{
    return !PATH_PLAIN && (s->discrepancy != NULL || s->speckle.table != NULL);
}

/* Stores the values of the present bounce of the walk that the factors need. */
static inline void path_factor_note(struct walk *w, struct bounce *b, const struct scene_ray *ray)
{
    memcpy(w->normal, b->normal, sizeof w->normal);
    if (w->first_out->n_bounce > 1) return;
    for (int a = 0; a < 3; a++) w->to_camera[a] = -ray->direction[a];
    w->cos_camera = fiber_frame_dot(w->to_camera, b->normal);
    if (w->s->speckle.table == NULL || w->film != NULL) return;
    b->has_speckle = true;
    w->i_fiber = scene_fiber_of(w->s->scene, b->hit.i_segment);
    fiber_frame_flat_in(&w->speckle_frame, b->hit.tangent, b->normal); /* turns with the fiber, without a jump */
    fiber_frame_to_local(&w->speckle_frame, w->to_camera, w->speckle_wo);
}

/* Multiplies light that reaches the bounce b from a direction by the factors; b NULL: light beyond the present bounce
 * of the walk. Light beside the cloth has no factor. Speckle is on light that one fiber alone scatters. */
static inline void path_factor_apply(const struct walk *w, const struct bounce *b, const float direction[3],
                                     float value[3])
{
    if (!path_factor_wanted(w->s) || w->first_out->n_bounce == 0) return;
    if (w->s->discrepancy != NULL) {
        double factor[3];
        discrepancy_factor(w->s->discrepancy, fiber_frame_dot(direction, b != NULL ? b->normal : w->normal),
                           w->cos_camera, fiber_frame_dot(direction, w->to_camera), factor);
        for (int c = 0; c < 3; c++) value[c] *= (float)factor[c];
    }
    if (w->s->speckle.table != NULL && (b != NULL ? b->has_speckle : w->first_out->n_bounce == 1 && w->film == NULL)) {
        float wi[3], factor[3];
        fiber_frame_to_local(&w->speckle_frame, direction, wi);
        speckle_factor(&w->s->speckle, w->i_fiber, wi, w->speckle_wo, factor);
        for (int c = 0; c < 3; c++) value[c] *= factor[c];
    }
}

#endif
