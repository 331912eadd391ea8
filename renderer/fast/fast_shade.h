/* Radiance of one eye's ray by the tables. */
#ifndef SELVEDGE_RENDERER_FAST_SHADE_H
#define SELVEDGE_RENDERER_FAST_SHADE_H

#include "renderer/fast/fast_setting.h"

/* s->path is filled in. STATUS_NO_MEMORY. */
status fast_setting_init(struct fast_setting *s, const struct fast_option *option, struct error *err);
void fast_setting_release(struct fast_setting *s);

/* ray: from camera_ray; it is changed. Adds to radiance. Result: the number of bounces traced. */
uint32_t fast_shade(const struct fast_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3]);

#endif
