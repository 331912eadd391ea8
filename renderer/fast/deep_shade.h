/* Light that is scattered more than n_traced times, by its table: path_setting.begin of a fast_setting whose option has
 * deep. */
#ifndef SELVEDGE_RENDERER_DEEP_SHADE_H
#define SELVEDGE_RENDERER_DEEP_SHADE_H

#include "base/rng.h"
#include "renderer/fast/deep_factor.h"
#include "renderer/scene/scene_ray.h"

/* context: the fast_setting. Adds the radiance along the ray reversed at its first hit. */
void deep_shade_begin(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                      float rgb[3]);
/* Adds the same without the factor of the option, times each of its terms; sum[c][0] is the radiance itself. */
void deep_shade_terms(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                      float sum[3][DEEP_FACTOR]);

#endif
