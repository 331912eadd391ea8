/* What a filtered view of a picture is guided by (renderer/preview/joint_filter.h): the features of the fibers that it
 * shows, and the light that is scattered once, in path-traced pictures of 24 samples or more up to three times, both
 * from more samples than the picture has; pictures by tables have their deep light with it. Both together cost about 15
 * or 40 to 70 % of the paths of a picture; 80 % of pictures by tables. */
#ifndef SELVEDGE_RENDERER_RENDER_GUIDES_H
#define SELVEDGE_RENDERER_RENDER_GUIDES_H

#include "renderer/preview/joint_filter.h"
#include "renderer/quick/dual_tables.h"
#include "renderer/transport/radiance_request.h"

struct render_guides {
    struct image feature, early; /* early: without pixels for pictures by dual scattering and by diffusion, which
                                     estimate it otherwise */
};

/* q: the request of the picture, of a surface model. averages: NULL, or for the albedo of fibers. Errors of
 * feature_image_render and render_run. Release in any case. */
status render_guides_make(const struct render_request *q, const struct dual_tables *averages, struct thread_pool *pool,
                          const struct progress *progress, struct render_guides *guides, struct error *err);
void render_guides_release(struct render_guides *guides);
/* Filters a picture that is given as two halves of its samples. out, error: of joint_filter. */
status render_guides_filter(const struct render_guides *guides, const struct image half[2], struct thread_pool *pool,
                            const struct progress *progress, struct image *out, double *error, struct error *err);

#endif
