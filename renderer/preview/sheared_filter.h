/* Sheared filtering of soft shadows, for previews (Yan, "Physically-based modeling and rendering of complex visual
 * appearance", 2018, sections 2.6 and 5.4; the filter is by Egan, Hecht, Durand and Ramamoorthi 2011).
 *
 * What a receiver sees of the lamp is estimated from its own rays and those of its neighbours. An occluder that hides
 * a place y of the lamp from one receiver hides a shifted place from the next one, and the filter follows that shift:
 * the weight of the ray of receiver x' to the place y' is w_x(x' - x) w_y(y' - eta (x - x')) along each edge of the
 * lamp, with eta the reciprocal of the harmonic mean of the least and the greatest slope at x. (Equation 2.25 prints
 * half of the harmonic mean itself, with a minus sign.)
 *
 * Both functions write visibility[height][width], the share of the lamp that is seen, and give the same bits for any
 * number of threads. Where nothing was met it is the mean of the receiver's own rays. light_field_smooth_slopes comes
 * first. STATUS_NO_MEMORY, STATUS_CANCELLED.
 */
#ifndef SELVEDGE_RENDERER_SHEARED_FILTER_H
#define SELVEDGE_RENDERER_SHEARED_FILTER_H

#include "base/thread_pool.h"
#include "renderer/preview/light_field.h"

enum sheared_lamp {
    SHEARED_GAUSSIAN_LAMP, /* brightness falls from the centre with a standard deviation of half the half side, as
                              published */
    SHEARED_SQUARE_LAMP    /* the same brightness everywhere, as lamps of configurations have it */
};

/* Radius of the filter in receivers. */
enum { SHEARED_REACH = 16 };

/* Sums over all rays of all receivers within reach: n^2 l^2 terms for each receiver. */
status sheared_filter_whole(const struct light_field *f, enum sheared_lamp lamp, struct thread_pool *pool,
                            const struct progress *progress, float *visibility, struct error *err);
/* The same in four passes of one dimension each (equations 5.7 to 5.10), n l terms for each receiver: along y and then
 * x of the first edge, and of the second. Equal where the slopes of neighbours are, but for the rounding of places on
 * the lamp to 4 l bins. */
status sheared_filter_passes(const struct light_field *f, enum sheared_lamp lamp, struct thread_pool *pool,
                             const struct progress *progress, float *visibility, struct error *err);

#endif
