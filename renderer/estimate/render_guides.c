#include "renderer/estimate/render_guides.h"
#include "renderer/estimate/render.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/preview/feature_image.h"

#include <string.h>

/* Hits of the light that is taken from samples of its own: three leave less structure to be guessed, but are worth
 * their noise only where there are many samples (renderer/preview/NOTES.md). Tables add their deep light at the first
 * hit, so that with one hit all but the light of a few hits is known. */
enum { FEW_HITS = 1, MORE_HITS = 3, FROM_SAMPLES = 24 };
enum { LEAST_EARLY = 16, MOST_EARLY = 128, LEAST_FEATURE = 8, MOST_FEATURE = 32, FIRST_EARLY = 1 << 24 };

static size_t samples(size_t wanted, size_t least, size_t most)
{
    const size_t n = wanted < most ? wanted : most;
    return n > least ? n : least;
}

/* a becomes the mean of two pixels, and its variance what they tell of it. */
static void mean_of(float *a, const float *b)
{
    for (int c = 0; c < 3; c++) {
        a[3 + c] = (a[c] - b[c]) * (a[c] - b[c]) / 4;
        a[c] = (a[c] + b[c]) / 2;
    }
}

static status make_early(const struct render_request *q, struct thread_pool *pool, const struct progress *progress,
                         struct image *early, struct error *err)
{
    struct render_request first = *q;
    if (q->input.dual != NULL || q->input.diffusion != NULL) return STATUS_OK;
    if (q->input.fast != NULL && !q->input.fast->deep) first.input.fast = NULL;
    const bool many = q->n_sample >= FROM_SAMPLES && q->input.fast == NULL; /* tables have these hits, and no others */
    first.input.n_hit = many ? MORE_HITS : FEW_HITS;
    first.n_sample = samples(2 * q->n_sample, LEAST_EARLY, MOST_EARLY) / 2;
    first.first_sample = FIRST_EARLY; /* other random numbers than the picture's */
    struct image other;
    status s = render_run(&first, pool, progress, early, err);
    if (s != STATUS_OK) return s;
    first.first_sample += RENDER_HALF;
    s = render_run(&first, pool, progress, &other, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < early->width * early->height; i++)
        mean_of(early->pixel + i * early->n_channel, other.pixel + i * other.n_channel);
    image_release(&other);
    return STATUS_OK;
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
                                      .n_sample = samples(q->n_sample, LEAST_FEATURE, MOST_FEATURE),
                                      .seed = q->seed};
    status s = feature_image_render(&f, pool, progress, &guides->feature, err);
    return s == STATUS_OK ? make_early(q, pool, progress, &guides->early, err) : s;
}

void render_guides_release(struct render_guides *guides)
{
    image_release(&guides->feature);
    image_release(&guides->early);
}

status render_guides_filter(const struct render_guides *guides, const struct image half[2], struct thread_pool *pool,
                            const struct progress *progress, struct image *out, double *error, struct error *err)
{
    const struct joint_input in = {.half = {&half[0], &half[1]},
                                   .early = guides->early.pixel != NULL ? &guides->early : NULL,
                                   .feature = &guides->feature};
    return joint_filter(&in, pool, progress, out, error, err);
}
