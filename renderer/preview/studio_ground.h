/* A matte, level ground without end under a bent cloth, under all lights of the configuration, with the shadow of the
 * cloth: a layer that is added to a picture of the cloth whose camera does not see the lights.
 *
 * The light on the ground is smooth, so it is found on a coarse grid of the picture and interpolated; where the cloth
 * hides the ground is found for every pixel. Light that the cloth lets through onto the ground keeps its
 * direction; light that it sends back to the ground is left out.
 */
#ifndef SELVEDGE_RENDERER_STUDIO_GROUND_H
#define SELVEDGE_RENDERER_STUDIO_GROUND_H

#include "base/thread_pool.h"
#include "renderer/image/image.h"
#include "renderer/preview/ground_request.h"

/* q->radius_mm is not used, and q->n_sample, made a square number, are the rays of a
 * pixel at the border of the cloth that find how much of it is hidden. im: rgb and
 * zero variances, initialised here, released on failure. STATUS_INVALID (a flat scene, a camera below the ground),
 * STATUS_NO_MEMORY, STATUS_CANCELLED. The bits do not depend on the number of threads. */
status studio_ground_render(const struct ground_request *q, struct thread_pool *pool, const struct progress *progress,
                            struct image *im, struct error *err);

#endif
