/* The lamp of a configuration, square or directional, in the frame of the turned cloth: millimetres, with the orbit
 * centre at the origin. A square lamp faces the orbit centre, has one horizontal edge, and emits from its front side
 * only. Its radiance is such that a surface at the orbit centre that faces the lamp has an irradiance of exactly pi
 * (configuration.h). A directional lamp is treated as one of 2^-60 sr: its weight against scattering samples rounds to
 * 1, and scattering samples never hit it.
 */
#ifndef SELVEDGE_RENDERER_LAMP_H
#define SELVEDGE_RENDERER_LAMP_H

#include "renderer/scene/configuration.h"

#include <stdbool.h>

struct lamp {
    float centre_mm[3];
    float edge[2][3]; /* unit: [0] horizontal */
    float normal[3];  /* unit, towards the orbit centre */
    float half_side_mm;
    float radiance;
    bool directional;
};

void lamp_init(struct lamp *lamp, const struct configuration *c);
/* Direction from position_mm (unwrapped) to a random point of the lamp; density per steradian. False behind the lamp.
 */
bool lamp_sample(const struct lamp *lamp, const float position_mm[3], const float u[2], float direction[3],
                 float *pdf_per_sr);
/* The density with which lamp_sample would have chosen this direction; 0 when it misses the lamp's front. */
float lamp_pdf(const struct lamp *lamp, const float position_mm[3], const float direction[3]);

#endif
