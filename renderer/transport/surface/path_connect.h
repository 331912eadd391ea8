/* Connections of a bounce with the lights, and how light is added to a path. Inside of path_tracer.c. */
#ifndef SELVEDGE_RENDERER_PATH_CONNECT_H
#define SELVEDGE_RENDERER_PATH_CONNECT_H

#include "renderer/transport/surface/fiber_walk.h"
#include "renderer/transport/surface/path_walk.h"

/* Adds value to the radiance and value * (H + score) to the derivatives. score NULL: the scores of the last step are
 * part of H already. */
static inline void path_add_light(struct walk *w, const float value[3], const float *score)
{
    for (int c = 0; c < 3; c++) w->out->radiance[c] += value[c];
    if (!w->s->want_jacobian) return;
    const size_t n = w->s->model->n_param;
    const float *h = w->h;
    float *jac = w->out->jac;
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < w->s->n_set; k++, h += n, jac += n)
            if (score != NULL && k == w->i_set)
                for (size_t p = 0; p < n; p++) jac[p] += value[c] * (h[p] + score[c * n + p]);
            else
                for (size_t p = 0; p < n; p++) jac[p] += value[c] * h[p];
}

static inline void path_add_light_to_all(struct walk *w, const float value[3], const float *score)
{
    for (size_t i = 0; i < w->n_out; i++) {
        w->out = w->first_out + i;
        path_add_light(w, value, score);
    }
}

static inline void path_leave(struct walk *w, const struct bounce *b, const float direction[3], struct scene_ray *ray)
{
    fiber_walk_leave(w->s->model, &b->hit, b->offset_mm, direction, w->rng, ray);
}

/* Next-event estimation from a bounce to a random point of the lamp and, if a narrow lobe meets the lamp, to one of the
 * strip that it sees. weight: multiple-importance weight of these connections, in [0, 1]. Sets the strip if the walk
 * has strips. Returns the incident light of the former as stored in path_step.light, or 0 if it is occluded. */
float path_connect_lamp(struct walk *w, const struct lamp *lamp, float weight, const struct bounce *b,
                        struct lamp_strip *strip, float wi[3]);
/* Next-event estimation from a bounce to one direction of the image environment. */
void path_connect_image(struct walk *w, const struct bounce *b);

#endif
