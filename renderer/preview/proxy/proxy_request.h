/* A request for a preview of a bent cloth by its smooth surface (proxy_picture.h). */
#ifndef SELVEDGE_RENDERER_PROXY_REQUEST_H
#define SELVEDGE_RENDERER_PROXY_REQUEST_H

#include "renderer/preview/appearance_table.h"
#include "renderer/preview/pixels/ray_filter.h"
#include "renderer/scene/configuration.h"
#include "renderer/scene/scene.h"

#include <stddef.h>
#include <stdint.h>

struct proxy_request {
    const struct scene *scene; /* bent */
    const struct configuration *configuration;
    const struct appearance_table *look; /* of the flat cloth: its mean over the repeat is shown */
    size_t width, height;
    size_t n_side;           /* n_side x n_side rays of a pixel for each of camera, lamp and light from other folds */
    enum ray_filter_way way; /* the same filter for all of them */
    bool no_bounce;          /* leaves light from other folds and from the environment out */
    uint64_t seed;
    uint32_t stream;
};

#endif
