/* The lamp of a configuration, square, directional or Gaussian, in the frame of the turned cloth: millimetres, with the
 * orbit centre at the origin. A square lamp faces the orbit centre, has one horizontal edge, and emits from its front
 * side only. Its radiance is such that a surface at the orbit centre that faces the lamp has an irradiance of exactly
 * pi (configuration.h). A directional lamp is treated as one of 2^-60 sr: its weight against scattering samples rounds
 * to 1, and scattering samples never hit it. A Gaussian lamp is a spherical Gaussian around the direction to it, the
 * same at all places (fabric thesis, section 6.2).
 */
#ifndef SELVEDGE_RENDERER_LAMP_H
#define SELVEDGE_RENDERER_LAMP_H

#include "renderer/scene/configuration.h"

#include <math.h>
#include <stdbool.h>

struct lamp {
    float centre_mm[3];
    float edge[2][3]; /* unit: [0] horizontal */
    float normal[3];  /* unit, towards the orbit centre */
    float half_side_mm;
    float radiance;  /* of a Gaussian lamp: in its middle */
    float sharpness; /* of a Gaussian lamp; 0: another */
    bool directional;
    bool distant; /* directional or Gaussian: all places see it in the same directions, around -normal */
};

void lamp_init(struct lamp *lamp, const struct configuration *c);
/* Radiance of the lamp in a direction that meets it. */
static inline float lamp_radiance(const struct lamp *l, const float direction[3])
{
    if (!(l->sharpness > 0)) return l->radiance;
    float square = 0; /* 2 (1 - cos), without cancellation */
    for (int a = 0; a < 3; a++) square += (direction[a] + l->normal[a]) * (direction[a] + l->normal[a]);
    return l->radiance * expf(-0.5f * l->sharpness * square);
}
/* Integral of a Gaussian lamp's radiance over directions: its light without a cosine. */
float lamp_gaussian_light(const struct lamp *lamp);
/* Direction from position_mm (unwrapped) to a random point of the lamp; density per steradian. False behind the lamp.
 */
bool lamp_sample(const struct lamp *lamp, const float position_mm[3], const float u[2], float direction[3],
                 float *pdf_per_sr);
/* The density with which lamp_sample would have chosen this direction; 0 when it misses the lamp's front. */
float lamp_pdf(const struct lamp *lamp, const float position_mm[3], const float direction[3]);

#endif
