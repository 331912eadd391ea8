/* A picture of one configuration: the crop that a photograph shows, pixel by pixel, with the same tracer as estimate.h.
 * Channels: R G B, var.R var.G var.B, and with derivatives d_<param>.R .G .B per flat parameter; with several parameter
 * sets d_set<i>.<param>.R .G .B. A crop that is not square wants crop_aspect = width / height for square pixels. */
#ifndef SELVEDGE_RENDERER_RENDER_H
#define SELVEDGE_RENDERER_RENDER_H

#include "renderer/image/image.h"
#include "renderer/transport/estimate.h"

struct render_request {
    const struct scene *scene;
    const struct scattering_model *model;
    const double *param; /* model->n_param for each set */
    const struct configuration *configuration;
    size_t width, height, n_sample; /* samples a pixel */
    uint64_t seed;
    uint32_t stream; /* takes the place of the configuration number in the random key */
    bool want_derivative;
    size_t n_set; /* as in estimate.h */
};

status render_run(const struct render_request *q, struct thread_pool *pool, const struct progress *progress,
                  struct image *im, struct error *err);

#endif
