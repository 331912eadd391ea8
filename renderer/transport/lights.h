/* All lights of a configuration, in the frame of the turned cloth, and how light samples and scattering samples are
 * combined (power heuristic, Veach and Guibas 1995). Both tracers use them.
 */
#ifndef SELVEDGE_RENDERER_LIGHTS_H
#define SELVEDGE_RENDERER_LIGHTS_H

#include "renderer/transport/environment.h"
#include "renderer/transport/lamp.h"

struct lights {
    struct lamp lamp;
    bool has_lamp;
    bool has_constant;
    bool unseen;       /* by camera rays */
    float constant[3]; /* the same radiance from every direction (from below only without the black sheet) */
    const struct environment *image; /* or NULL */
    float image_turn[2];             /* cosine and sine of the angle from the cloth's frame to the world's */
};

void lights_init(struct lights *l, const struct configuration *c);

static inline float lights_power_heuristic(float pdf, float other_pdf)
{
    float r = other_pdf / pdf;
    return 1 / (1 + r * r);
}

/* Turns d about the cloth normal by an angle of cosine and sine by[2] (sign 1), or back (-1). */
static inline void lights_turn(const float by[2], float sign, const float d[3], float out[3])
{
    out[0] = by[0] * d[0] - sign * by[1] * d[1];
    out[1] = sign * by[1] * d[0] + by[0] * d[1];
    out[2] = d[2];
}

/* A direction of the image drawn in proportion to luminance, its radiance and density. False when the image is
 * black. */
static inline bool lights_sample_image(const struct lights *l, const float u[2], float direction[3], float radiance[3],
                                       float *pdf_per_sr)
{
    float world[3];
    if (!environment_sample(l->image, u, world, radiance, pdf_per_sr)) return false;
    lights_turn(l->image_turn, -1, world, direction);
    return true;
}

/* Radiance that a ray from position_mm (unwrapped) meets when it hits the lamp, times its share beside light samples.
 * pdf: density of the scattering sample that made the ray, 0 for a camera ray. */
static inline float lights_lamp_beyond(const struct lamp *lamp, const float position_mm[3], const float direction[3],
                                       float pdf)
{
    float pdf_lamp = lamp_pdf(lamp, position_mm, direction);
    return pdf_lamp > 0 ? lamp_radiance(lamp, direction) * (pdf > 0 ? lights_power_heuristic(pdf, pdf_lamp) : 1) : 0;
}

/* Adds the radiance of both environments; the image counts by its share beside light samples. */
static inline void lights_add_environment(const struct lights *l, const float direction[3], float pdf, float beyond[3])
{
    for (int c = 0; c < 3 && l->has_constant; c++) beyond[c] += l->constant[c];
    if (l->image == NULL) return;
    float world[3], radiance[3];
    lights_turn(l->image_turn, 1, direction, world);
    float pdf_image = environment_at(l->image, world, radiance);
    float share = pdf > 0 ? lights_power_heuristic(pdf, pdf_image) : 1;
    for (int c = 0; c < 3; c++) beyond[c] += radiance[c] * share;
}

#endif
