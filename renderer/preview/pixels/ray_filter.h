/* Filters of the rays of pixels (ray_field.h), for previews. Each writes mean[height][width][n_channel]: the mean of
 * the values of a pixel's rays, with the weights of window and directions. Pixels without a receiver get 0, and pixels
 * whose rays have met nothing the mean of their own rays. The bits do not depend on the number of threads.
 *
 * Sheared filtering (by Egan, Hecht, Durand and Ramamoorthi 2011) follows the light of a pixel to its neighbours: an
 * occluder that hides a place y of the lamp from one receiver hides a shifted place from the next one. The ray of a
 * neighbour at x' to the place y' counts as one of the pixel's own to the place y = y' + eta (x' - x), with a Gaussian
 * weight of x' - x and the window's weight at y, along each axis (equations 2.23 to 2.25). eta is the reciprocal of the
 * harmonic mean of the least and the greatest slope at x. (Equation 2.25 prints half of the harmonic mean itself, with
 * a minus sign.)
 *
 * Axis-aligned filtering takes means of pixels (Mehta, Wang and Ramamoorthi 2012) with a Gaussian of half |s_min| / 6,
 * where s_min is the slope nearest to 0 (their k = 3 and mu = 1). Pixels whose slopes have both signs have no shear:
 * the four passes give them the mean of their own rays, and the other filters the narrowest Gaussian, of a quarter of
 * a pixel.
 */
#ifndef SELVEDGE_RENDERER_RAY_FILTER_H
#define SELVEDGE_RENDERER_RAY_FILTER_H

#include "base/thread_pool.h"
#include "renderer/preview/pixels/ray_field.h"

enum ray_filter_way {
    RAY_PASSES, /* four passes of one dimension (equations 5.7 to 5.10) */
    RAY_WHOLE,  /* one sum over four dimensions (equation 5.4), for comparison */
    RAY_AXIS,   /* axis-aligned */
    RAY_OWN     /* the pixel's own rays alone */
};

/* STATUS_NO_MEMORY, STATUS_CANCELLED. */
status ray_filter(const struct ray_field *f, enum ray_filter_way way, struct thread_pool *pool,
                  const struct progress *progress, float *mean, struct error *err);

/* The four passes, as ray_filter calls them. */
status ray_filter_passes(const struct ray_field *f, struct thread_pool *pool, const struct progress *progress,
                         float *mean, struct error *err);

#endif
