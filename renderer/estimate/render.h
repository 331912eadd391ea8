/* A picture of one configuration: the crop that a photograph shows, pixel by pixel, with the same tracers as
 * estimate.h.
 *
 * Channels: R G B, var.R var.G var.B (of the mean; infinite for one sample), and with derivatives d_<name>.R .G .B for
 * every flat parameter (radiance_derivative_name). The bits do not depend on the number of threads. Estimates use
 * other random numbers. A crop that is not square wants crop_aspect = width / height for square pixels. Of a
 * configuration with n_rotation it shows the first rotation.
 */
#ifndef SELVEDGE_RENDERER_RENDER_H
#define SELVEDGE_RENDERER_RENDER_H

#include "base/thread_pool.h"
#include "renderer/image/image.h"
#include "renderer/transport/radiance_request.h"

/* Samples of a pixel lie evenly in it, among those whose numbers have the same quotient by RENDER_HALF. So pictures of
 * samples from 0 and from RENDER_HALF on are independent halves of one; of numbers that go on they are not. */
#define RENDER_HALF ((size_t)1 << 20)

/* im: initialised here, released on failure. Variances are as of independent samples, a little too large.
 * STATUS_INVALID (no pixels or samples, too many, a stream above 4095, and as for an estimate), STATUS_NO_MEMORY,
 * STATUS_CANCELLED (looked for every 64 samples or more often), STATUS_NUMERIC naming model, pixel and channel. */
status render_run(const struct render_request *q, struct thread_pool *pool, const struct progress *progress,
                  struct image *im, struct error *err);

#endif
