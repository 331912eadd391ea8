/* A filter for noisy pictures of cloth, for the eye: it keeps yarns and fibers, because light that is scattered up to a
 * few times comes from more samples, and all other light is a linear function of what each pixel shows (README.md). A
 * filtered picture is no measurement. */
#ifndef SELVEDGE_RENDERER_JOINT_FILTER_H
#define SELVEDGE_RENDERER_JOINT_FILTER_H

#include "base/thread_pool.h"
#include "renderer/image/image.h"

#define JOINT_FILTER_ID "joint.v3" /* in results */

/* Pictures of the same size. */
struct joint_input {
    const struct image *half[2]; /* rgb of independent samples of the same view, about as many each; further channels
                                     are not looked at */
    const struct image *early;   /* rgb and variances of the picture with radiance_input.n_hit; NULL: none */
    const struct image *feature; /* of feature_image_render */
};

/* out: rgb, initialised here, released on failure. *error: estimated root mean square error of a pixel of `out` over
 * the mean radiance, from what each filtered half says of the other: at least the noise that is left, and more where
 * blur shows beside the noise of the halves; NaN for a black picture. Pixels that show no fiber are the mean of both
 * halves. The bits do not depend on the number of threads. STATUS_INVALID, STATUS_NO_MEMORY, STATUS_CANCELLED. */
status joint_filter(const struct joint_input *in, struct thread_pool *pool, const struct progress *progress,
                    struct image *out, double *error, struct error *err);

#endif
