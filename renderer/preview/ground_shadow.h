/* A matte plane under a bent cloth with the shadow that the cloth casts on it, as a layer that is added to a picture of
 * the cloth.
 *
 * The plane has the light of the square or directional lamp where no fiber and no black sheet hides it. Light that the
 * cloth scatters onto the plane is left out, and so is light from the plane onto the cloth. The layer is 0 where the
 * cloth hides the plane, so that picture and layer can be added.
 */
#ifndef SELVEDGE_RENDERER_GROUND_SHADOW_H
#define SELVEDGE_RENDERER_GROUND_SHADOW_H

#include "base/thread_pool.h"
#include "renderer/image/image.h"
#include "renderer/preview/ground_request.h"

/* z_mm of a plane that lies gap_mm under the lowest point of a bent cloth, the thickness included. */
double ground_below(const struct scene *bent, double gap_mm);
/* Every ray of a pixel that meets the plane has one ray to the lamp. im: rgb and the variances of the means,
 * initialised here, released on failure. STATUS_INVALID, STATUS_NO_MEMORY, STATUS_CANCELLED. The bits do not depend on
 * the number of threads. */
status ground_render(const struct ground_request *q, struct thread_pool *pool, const struct progress *progress,
                     struct image *im, struct error *err);
/* The same without noise of the lamp's rays, by sheared filtering (pixels/ray_filter.h) on a grid of the plane with
 * n_side * n_side rays a place: a preview. whole: by the sum over four dimensions in place of the four passes. im: rgb.
 * STATUS_INVALID also for a directional lamp, whose shadow is sharp. */
struct ground_filter {
    size_t n_side;
    bool whole;
};
status ground_render_filtered(const struct ground_request *q, const struct ground_filter *filter,
                              struct thread_pool *pool, const struct progress *progress, struct image *im,
                              struct error *err);

#endif
