/* Albedo, normal, direction and distance of the fibers that each pixel of a picture shows: means over a few camera
 * rays, and the variances of these means. */
#ifndef SELVEDGE_RENDERER_FEATURE_IMAGE_H
#define SELVEDGE_RENDERER_FEATURE_IMAGE_H

#include "base/thread_pool.h"
#include "renderer/image/image.h"
#include "renderer/quick/dual_tables.h"
#include "renderer/scene/configuration.h"
#include "renderer/scene/scene.h"

/* Albedo of the fiber in rgb; its normal in the cloth's frame; the distance from the plane of the crop over its width;
 * the direction t of the fiber along the camera's right, up and view, as t_r^2 - t_u^2, 2 t_r t_u and t_v^2, which do
 * not depend on its sign; 1. All are 0 where nothing is seen. */
enum {
    FEATURE_ALBEDO = 0,
    FEATURE_NORMAL = 3,
    FEATURE_DISTANCE = 6,
    FEATURE_TANGENT = 7,
    FEATURE_SEEN = 10,
    N_FEATURE = 11
};

struct feature_request {
    const struct scene *scene;
    const struct dual_tables *averages; /* NULL: the albedo is 1 */
    const struct configuration *configuration;
    size_t width, height, n_sample; /* rays a pixel, at least 2 */
    uint64_t seed;
};

/* im: initialised here with 2 N_FEATURE channels, means before variances; released on failure. STATUS_INVALID,
 * STATUS_NO_MEMORY, STATUS_CANCELLED. */
status feature_image_render(const struct feature_request *q, struct thread_pool *pool, const struct progress *progress,
                            struct image *im, struct error *err);

#endif
