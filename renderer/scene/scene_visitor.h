/* The fibers ahead of a ray of the flat cloth: whether there are any, or a visit of each. For the files of this
 * folder. */
#ifndef SELVEDGE_RENDERER_SCENE_VISITOR_H
#define SELVEDGE_RENDERER_SCENE_VISITOR_H

#include "renderer/scene/scene_ray.h"

/* The arguments that scene_visit_ahead passes on. */
struct scene_visitor {
    const struct scene *flat;
    scene_visit *visit;
    void *context;
    float direction[3];      /* unit, of the ray where it is seen */
    const float *to_seen[3]; /* rows of the map of flat tangents to seen ones; [0] NULL: they are the same */
    bool stopped;
};

/* visitor NULL: whether any hit lies ahead. Otherwise each one is visited; true: the visitor has asked to
 * stop. */
bool scene_occluded_span(const struct scene *scene, const struct scene_ray *ray, float span,
                         struct scene_visitor *visitor);
void scene_visitor_init(struct scene_visitor *v, const struct scene *flat, const float direction[3], scene_visit *visit,
                        void *context);
/* Visits a segment. False: no further ones are wanted. */
bool scene_visitor_see(struct scene_visitor *v, uint32_t i_segment);

#endif
