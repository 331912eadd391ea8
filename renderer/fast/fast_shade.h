/* Radiance of one eye's ray by the tables. */
#ifndef SELVEDGE_RENDERER_FAST_SHADE_H
#define SELVEDGE_RENDERER_FAST_SHADE_H

#include "renderer/fast/fast_option.h"
#include "renderer/fast/light_mixture.h"
#include "renderer/transport/surface/path_tracer.h"

struct fast_setting {
    struct path_setting path; /* first; scene, model, lights; its paths are those that correct */
    const struct fast_option *option;
    struct light_mixture mixture;
    /* Of a flat cloth: radiance that arrives at each row of transfer, n_transfer x 3 x n_harmonic, under the lamp as it
     * is seen from the orbit centre and the environment. NULL: it is computed hit by hit. */
    float *arriving;
};

/* s->path is filled in. STATUS_NO_MEMORY. */
status fast_setting_init(struct fast_setting *s, const struct fast_option *option, struct error *err);
void fast_setting_release(struct fast_setting *s);

/* ray: from camera_ray; it is changed. Adds to radiance. Result: the number of bounces traced. */
uint32_t fast_shade(const struct fast_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3]);

#endif
