/* Light from other parts of a bent cloth: from fold to fold, and through the layers of a roll. They are taken for matte
 * surfaces that send back and let through the shares of the table of deep light, and are lit by the setting's
 * lights. */
#ifndef SELVEDGE_RENDERER_LAYER_LIGHT_H
#define SELVEDGE_RENDERER_LAYER_LIGHT_H

#include "renderer/fast/fast_setting.h"

/* One estimate of the radiance that comes from a direction to a place outside of the cloth, less the lights' own. */
void layer_light_arriving(const struct fast_setting *s, const float point_mm[3], const float direction[3],
                          struct rng *rng, float rgb[3]);
/* A direction around z by its cosine. */
void layer_light_direction(struct rng *rng, float local[3]);

#endif
