/* The radiance along one camera ray, by the tables of the fast renderer. */
#ifndef SELVEDGE_RENDERER_FAST_SHADE_H
#define SELVEDGE_RENDERER_FAST_SHADE_H

#include "renderer/fast/fast_setting.h"

/* s->path is filled in. STATUS_NO_MEMORY. */
status fast_setting_init(struct fast_setting *s, const struct fast_option *option, struct error *err);
void fast_setting_release(struct fast_setting *s);

/* Adds the radiance along a ray of camera_ray to `radiance`. Changes the ray. Returns the number of bounces traced. */
uint32_t fast_shade(const struct fast_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3]);

#endif
