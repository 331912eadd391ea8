/* The radiance along one camera ray, by dual scattering. */
#ifndef SELVEDGE_RENDERER_DUAL_SHADE_H
#define SELVEDGE_RENDERER_DUAL_SHADE_H

#include "renderer/quick/dual_tables.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/transport/surface/path_tracer.h"

struct dual_setting {
    struct path_setting path; /* first; scene, model, parameter sets, lights; no paths are traced */
    const struct dual_option *option;
};

/* The place where a camera ray meets a fiber. */
struct dual_hit {
    struct scene_hit hit;
    double offset_mm[2];
    struct fiber_frame frame;
    float wo[3]; /* in the fiber frame */
    size_t i_set;
};

/* The light that arrives at a hit from a direction: the transmittance of the fibers in front for each channel, and the
 * variance that these fibers add to the light's angle with the fiber. Light that passes no fiber: 1, 0 and 0 fibers. */
struct dual_front {
    float transmitted[3], var_rad2;
    uint32_t n_fiber;
};

/* False: none arrives. */
bool dual_front_of(const struct dual_setting *s, const struct dual_hit *h, const float direction[3], struct rng *rng,
                   struct dual_front *front);
/* What takes the place of S for light from wi (fiber frame): single scattering and light from behind, or what the
 * fibers in front make of both. */
void dual_scattering(const struct dual_setting *s, const struct dual_hit *h, const float wi[3],
                     const struct dual_front *front, float s_rgb[3]);

/* Adds the radiance along a ray of camera_ray to `radiance`. Changes the ray. Returns the number of hits, 0 or 1. */
uint32_t dual_shade(const struct dual_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3]);

#endif
