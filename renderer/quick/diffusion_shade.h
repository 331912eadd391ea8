/* The radiance along one camera ray: some traced hits, and diffusion for the light that is scattered more often. */
#ifndef SELVEDGE_RENDERER_DIFFUSION_SHADE_H
#define SELVEDGE_RENDERER_DIFFUSION_SHADE_H

#include "renderer/quick/diffusion_tables.h"
#include "renderer/transport/surface/path_tracer.h"

struct diffusion_setting {
    struct path_setting path; /* first; scene, model, lights; it ends paths at their last traced hit */
    const struct diffusion_option *option;
};

/* s->path is filled in. s must stay where it is. */
void diffusion_setting_init(struct diffusion_setting *s, const struct diffusion_option *option);

/* Adds the radiance along a ray of camera_ray to `radiance`. Changes the ray. Returns the number of bounces traced. */
uint32_t diffusion_shade(const struct diffusion_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3]);

#endif
