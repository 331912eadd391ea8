/* Inside the plain BRDF: radiance of one configuration as a linear function of the colours, for a given shape. */
#ifndef SELVEDGE_OPTIMIZER_PLAIN_BRDF_TERMS_H
#define SELVEDGE_OPTIMIZER_PLAIN_BRDF_TERMS_H

#include "renderer/scene/configuration.h"

#include <stdbool.h>

enum { PLAIN_DIFFUSE, PLAIN_F0, PLAIN_SHEEN, PLAIN_N_COLOUR };

struct plain_shape {
    double retro, roughness, sheen_roughness;
    bool separable_masking;
};

/* Lamp in front: L = constant + sum of factor[k] times colour k. behind: L = factor[0] times the transmission. */
struct plain_term {
    double factor[PLAIN_N_COLOUR], constant;
    bool behind;
};

void plain_terms(const struct plain_shape *s, const struct configuration *c, struct plain_term *t);

#endif
