/* A picture of one configuration for either kind of cloth: render.h for surfaces, and its twin for volumes. Channels R G
 * B, var.R var.G var.B and, when wanted, d_<param>.R .G .B for every parameter of the appearance; the random numbers are
 * apart from those of estimates. */
#ifndef SELVEDGE_RENDERER_APPEARANCE_RENDER_H
#define SELVEDGE_RENDERER_APPEARANCE_RENDER_H

#include "renderer/image/image.h"
#include "renderer/transport/appearance_estimate.h"

struct appearance_render_request {
    struct appearance_scene scene;
    const struct appearance *model;
    const double *param; /* model->n_param, internal units */
    const struct configuration *configuration;
    size_t width, height, n_sample; /* samples a pixel */
    uint64_t seed;
    uint32_t stream; /* takes the place of the configuration number in the random key */
    bool want_derivative;
};

/* STATUS_INVALID (sizes, a parameter, a cloth without the form that the model needs), STATUS_CANCELLED, STATUS_NUMERIC. */
status appearance_render_run(const struct appearance_render_request *q, struct thread_pool *pool,
                             const struct progress *progress, struct image *im, struct error *err);

#endif
