/* A joint filter of color and features, for previews: README.md says how it works. A filtered picture is for the eye
 * only.
 */
#ifndef SELVEDGE_RENDERER_JOINT_FILTER_H
#define SELVEDGE_RENDERER_JOINT_FILTER_H

#include "base/thread_pool.h"
#include "renderer/image/image.h"

/* picture: R G B and their variances, all finite. feature: of feature_image_render, of the same size. out: rgb,
 * initialised here, released on failure. Where the picture has no variance and no neighbour like it, it stays as it
 * is. The bits do not depend on the number of threads. STATUS_INVALID, STATUS_NO_MEMORY, STATUS_CANCELLED. */
status joint_filter(const struct image *picture, const struct image *feature, struct thread_pool *pool,
                    const struct progress *progress, struct image *out, struct error *err);

#endif
