/* A picture of one configuration for a cloth given as a volume: render.h's twin, with the same channels and rules.
 * Derivatives are by the phase model's parameters, d_<param>.R .G .B, and by d, d_density_multiplier.R .G .B (1/m). */
#ifndef SELVEDGE_RENDERER_VOLUME_RENDER_H
#define SELVEDGE_RENDERER_VOLUME_RENDER_H

#include "renderer/image/image.h"
#include "renderer/transport/volume_estimate.h"

struct volume_render_request {
    const struct volume_scene *scene;
    const struct phase_model *model;
    const double *param;     /* model->n_param, internal units */
    double multiplier_per_m; /* d > 0 */
    const struct configuration *configuration;
    size_t width, height, n_sample; /* samples a pixel */
    uint64_t seed;
    uint32_t stream; /* takes the place of the configuration number in the random key */
    bool want_derivative;
};

/* STATUS_INVALID (sizes, the configuration, d or a parameter), STATUS_NO_MEMORY, STATUS_CANCELLED, STATUS_NUMERIC. */
status volume_render_run(const struct volume_render_request *q, struct thread_pool *pool,
                         const struct progress *progress, struct image *im, struct error *err);

#endif
