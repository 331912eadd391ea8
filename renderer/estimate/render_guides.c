#include "renderer/estimate/render_guides.h"
#include "renderer/estimate/render.h"
#include "renderer/preview/feature_image.h"

#include <string.h>

enum { LEAST_DIRECT = 16, MOST_DIRECT = 128, LEAST_FEATURE = 16, MOST_FEATURE = 64, FIRST_DIRECT = 1 << 24 };

static size_t samples(size_t wanted, size_t least, size_t most)
{
    const size_t n = wanted < most ? wanted : most;
    return n > least ? n : least;
}

static status make_direct(const struct render_request *q, struct thread_pool *pool, const struct progress *progress,
                          struct image *direct, struct error *err)
{
    struct render_request first = *q;
    if (q->input.dual != NULL || q->input.diffusion != NULL) return STATUS_OK;
    first.input.fast = NULL;
    first.input.first_hit = true;
    first.n_sample = samples(4 * q->n_sample, LEAST_DIRECT, MOST_DIRECT);
    first.first_sample = FIRST_DIRECT; /* other random numbers than the picture's */
    return render_run(&first, pool, progress, direct, err);
}

status render_guides_make(const struct render_request *q, const struct dual_tables *averages, struct thread_pool *pool,
                          const struct progress *progress, struct render_guides *guides, struct error *err)
{
    memset(guides, 0, sizeof *guides);
    const struct feature_request f = {.scene = q->input.scene.fibers,
                                      .averages = averages,
                                      .configuration = q->configuration,
                                      .width = q->width,
                                      .height = q->height,
                                      .n_sample = samples(2 * q->n_sample, LEAST_FEATURE, MOST_FEATURE),
                                      .seed = q->seed};
    status s = feature_image_render(&f, pool, progress, &guides->feature, err);
    return s == STATUS_OK ? make_direct(q, pool, progress, &guides->direct, err) : s;
}

void render_guides_release(struct render_guides *guides)
{
    image_release(&guides->feature);
    image_release(&guides->direct);
}

status render_guides_filter(const struct render_guides *guides, const struct image half[2], struct thread_pool *pool,
                            const struct progress *progress, struct image *out, double *error, struct error *err)
{
    const struct joint_input in = {.half = {&half[0], &half[1]},
                                   .direct = guides->direct.pixel != NULL ? &guides->direct : NULL,
                                   .feature = &guides->feature};
    return joint_filter(&in, pool, progress, out, error, err);
}
