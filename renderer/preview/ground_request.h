/* A request for the ground under a cloth (ground_shadow.h). */
#ifndef SELVEDGE_RENDERER_GROUND_REQUEST_H
#define SELVEDGE_RENDERER_GROUND_REQUEST_H

#include "renderer/scene/configuration.h"
#include "renderer/scene/scene.h"

#include <stddef.h>
#include <stdint.h>

struct ground_request {
    const struct scene *scene; /* bent */
    const struct configuration *configuration;
    double z_mm;      /* of the plane, below the cloth; the orbit center is at 0 */
    double radius_mm; /* the plane is a disc around the z axis */
    double albedo;
    /* rgb: share of light that each layer of the cloth lets through, for the studio; NULL: none */
    const float *through;
    size_t width, height, n_sample; /* rays a pixel, at least 2 */
    uint64_t seed;
    uint32_t stream;
};

#endif
