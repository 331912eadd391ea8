/* A picture pixel by pixel, for every kind of cloth: cutting into tasks, means and variances, names of channels. What is
 * behind render.h and volume_render.h.
 *
 * Channels: R G B, var.R var.G var.B (of the mean; infinite for one sample), and for every derivative its name with .R
 * .G .B. The bits do not depend on the number of threads. Cancellation is looked for every RENDER_CHUNK samples.
 */
#ifndef SELVEDGE_RENDERER_RENDER_PIXELS_H
#define SELVEDGE_RENDERER_RENDER_PIXELS_H

#include "base/progress.h"
#include "base/rng.h"
#include "base/thread_pool.h"
#include "renderer/image/image.h"
#include "renderer/scattering/scattering.h"

enum { RENDER_CHUNK = 64, RENDER_NAME_BYTES = 56 };

struct render_pixels {
    size_t width, height, n_sample; /* samples a pixel */
    uint64_t seed;
    uint32_t stream; /* takes the place of the configuration number in the random key */
    size_t n_flat;   /* derivatives of a channel; 0: none */
    const char *id;  /* the model's, for messages */
    /* n <= RENDER_CHUNK paths: x and y in [0, 1) of the crop, a generator each (may be changed),
     * value[n][3 + 3 * n_flat] preset to 0: radiance, then derivatives [c * n_flat + p]. */
    void (*trace)(void *context, size_t n, double (*xy)[2], struct rng *rng, float *value);
    void (*name)(void *context, size_t i_flat, char text[RENDER_NAME_BYTES]); /* of a derivative, without channel */
    void *context;
};

/* STATUS_INVALID (no pixels or samples, too many, a stream above 4095); to be asked before anything is prepared. */
status render_pixels_check(const struct render_pixels *p, struct error *err);
/* im: initialised here, released on failure. STATUS_INVALID, STATUS_NO_MEMORY, STATUS_CANCELLED; STATUS_NUMERIC naming
 * model, pixel and channel. */
status render_pixels_run(const struct render_pixels *p, struct thread_pool *pool, const struct progress *progress,
                         struct image *im, struct error *err);

#endif
