/* Walks of light through a cloth that no lamp guides, for tables of the scattering of a cloth: rays from outside, and
 * steps from fiber to fiber. Models of round fibers only (scattering_frame_reason).
 */
#ifndef SELVEDGE_RENDERER_FIBER_WALK_H
#define SELVEDGE_RENDERER_FIBER_WALK_H

#include "base/rng.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/surface/parameter_sets.h"

enum { FIBER_WALK_MOST_STEPS = 10000 };

/* A ray from outside into a flat cloth, at a uniform place of the tile, whose direction has a density in proportion to
 * its cosine to the normal. False: it does not meet the cloth. */
bool fiber_walk_enter(const struct scene *scene, bool from_below, struct rng *rng, struct scene_ray *ray);

/* Starts a ray where light leaves a fiber that was hit, as the model has it (scattering_model.across_width). */
static inline void fiber_walk_leave(const struct scattering_model *model, const struct scene_hit *hit,
                                    const double offset_mm[2], const float direction[3], struct rng *rng,
                                    struct scene_ray *ray)
{
    if (model->across_width)
        scene_ray_leave_across(hit, offset_mm, direction, rng_float(rng), ray);
    else
        scene_ray_leave(hit, offset_mm, direction, ray);
}

/* Scatters a ray at its hit: ray becomes the one that goes on, and throughput is multiplied by the fiber's weight.
 * Walks of little throughput are ended at random. False: the walk ends here. */
bool fiber_walk_step(const struct scene *scene, const struct parameter_sets *sets, const struct scene_hit *hit,
                     struct scene_ray *ray, struct rng *rng, float throughput[3]);

#endif
