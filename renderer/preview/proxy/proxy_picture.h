/* A preview of a bent cloth: its smooth surface with the mean appearance of the flat cloth, soft shadows of the lamp on
 * the cloth itself, light that another fold or the environment sends (one matte bounce), and a lens, each from few rays
 * that are filtered (ray_filter.h). It shows no fibers and no holes, so it is biased, and nothing that fits reads it.
 *
 * Differences from the published system (dissertation of Yan, sections 5.4 to 5.6 and appendix E): places are told by
 * the lamp's coordinates in place of steps on the screen; the lens takes shadows and light of other folds from the
 * filtered pinhole picture where its rays meet what the pinhole sees, and a ray of its own elsewhere; a disc of a lens
 * is taken as a Gaussian of the same variance, as its four passes want one. Occluders let as much light through as the
 * flat cloth does, undeviated.
 */
#ifndef SELVEDGE_RENDERER_PROXY_PICTURE_H
#define SELVEDGE_RENDERER_PROXY_PICTURE_H

#include "base/thread_pool.h"
#include "renderer/image/image.h"
#include "renderer/preview/proxy/proxy_request.h"

/* im: rgb and as many variances, which are not known: NaN. Initialised here, released on failure. STATUS_INVALID as
 * proxy_surface_init, STATUS_NO_MEMORY, STATUS_CANCELLED. The bits do not depend on the number of threads. */
status proxy_picture_render(const struct proxy_request *q, struct thread_pool *pool, const struct progress *progress,
                            struct image *im, struct error *err);

#endif
