#include "renderer/estimate/render.h"
#include "renderer/estimate/radiance_source.h"

#include "base/ranks/rank_team.h"
#include "renderer/estimate/rank_orders.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    CHUNK_SAMPLES = 64,
    TASK_SAMPLES = 512,
    NAME_BYTES = RADIANCE_NAME_BYTES + 8,
    N_VALUE = 3 + 3 * SCATTERING_MAX_FLAT
};
/* apart from estimate.h, which counts iterations upwards from 0 */
enum { RENDER_ITERATION = 65535, RENDER_REPLICA = 15 };

struct run {
    const struct render_request *q;
    const struct radiance_source *source;
    const struct progress *progress;
    struct image *im;
    size_t pixels_per_task, n_pixel;
};

/* Places of samples in a pixel, which lie more evenly than random ones (Roberts' sequence in two dimensions, moved by a
 * random way for each pixel): what fibers show differs within a pixel by more than by the random numbers of its paths.
 */
static void place_samples(const struct run *r, const struct rng_key *key, size_t i_pixel, size_t first, size_t n,
                          double (*xy)[2])
{
    static const double step[2] = {0.7548776662466927, 0.5698402909980532};
    const size_t corner[2] = {i_pixel % r->q->width, i_pixel / r->q->width}, size[2] = {r->q->width, r->q->height};
    struct rng rng;
    double start[2];
    rng_start(&rng, key, (uint32_t)i_pixel, UINT32_MAX - (uint32_t)(first / RENDER_HALF));
    for (int a = 0; a < 2; a++) start[a] = rng_double(&rng);
    for (size_t i = 0; i < n; i++)
        for (int a = 0; a < 2; a++) {
            const double u = start[a] + (double)(first + i) * step[a];
            xy[i][a] = ((double)corner[a] + u - floor(u)) / (double)size[a];
        }
}

/* Adds n samples of a pixel, from number `first`. */
static void add_samples(const struct run *r, size_t i_pixel, size_t first, size_t n, double *x, double *x2)
{
    const struct render_request *q = r->q;
    const struct rng_key key = {q->seed, RENDER_ITERATION, RENDER_REPLICA, q->stream};
    const size_t configuration = 0;
    size_t n_value = 3 + 3 * r->source->n_flat;
    struct rng rng[CHUNK_SAMPLES];
    double xy[CHUNK_SAMPLES][2];
    float value[CHUNK_SAMPLES * N_VALUE];
    const struct radiance_block block = {
        .member = &configuration, .n_member = 1, .n_path = n, .xy = xy, .rng = rng, .progress = r->progress};
    memset(value, 0, n * n_value * sizeof *value);
    place_samples(r, &key, i_pixel, first, n, xy);
    for (size_t i = 0; i < n; i++) rng_start(&rng[i], &key, (uint32_t)i_pixel, (uint32_t)(first + i));
    r->source->tracer->trace(r->source->state, &block, value);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n_value; k++) {
            double v = (double)value[i * n_value + k];
            x[k] += v;
            if (k < 3) x2[k] += v * v;
        }
}

static void render_pixel(struct run *r, size_t i_pixel)
{
    size_t n_sample = r->q->n_sample, n_flat = r->source->n_flat;
    double x[N_VALUE] = {0}, x2[3] = {0}, n = (double)n_sample;
    for (size_t i = 0; i < n_sample; i += CHUNK_SAMPLES) {
        if (progress_cancelled(r->progress)) return;
        add_samples(r, i_pixel, r->q->first_sample + i, n_sample - i < CHUNK_SAMPLES ? n_sample - i : CHUNK_SAMPLES, x,
                    x2);
    }
    float *out = r->im->pixel + i_pixel * r->im->n_channel;
    for (size_t k = 0; k < 3; k++) {
        double mean = x[k] / n;
        out[k] = (float)mean;
        out[3 + k] = n_sample > 1 ? (float)(fmax(0, x2[k] - x[k] * mean) / (n * (n - 1))) : INFINITY;
    }
    for (size_t k = 0; k < 3 * n_flat; k++) out[6 + 3 * (k % n_flat) + k / n_flat] = (float)(x[3 + k] / n);
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    size_t first = i_task * r->pixels_per_task, last = first + r->pixels_per_task;
    for (size_t i = first; i < last && i < r->n_pixel && !progress_cancelled(r->progress); i++) render_pixel(r, i);
}

/* ---- pixels that other ranks have rendered ---- */

static size_t task_pixels(const struct run *r, size_t i_task, float **pixel)
{
    size_t first = i_task * r->pixels_per_task, n = r->n_pixel - first;
    *pixel = r->im->pixel + first * r->im->n_channel;
    return (n < r->pixels_per_task ? n : r->pixels_per_task) * r->im->n_channel * sizeof **pixel;
}

static size_t pack_task(void *context, size_t i_task, void *to)
{
    float *pixel;
    size_t n = task_pixels(context, i_task, &pixel);
    memcpy(to, pixel, n);
    return n;
}

static bool unpack_task(void *context, size_t i_task, const void *from, size_t n_bytes)
{
    float *pixel;
    if (n_bytes != task_pixels(context, i_task, &pixel)) return false;
    memcpy(pixel, from, n_bytes);
    return true;
}

static status run_tasks(struct run *r, size_t n_task, struct thread_pool *pool, struct error *err)
{
    struct rank_team *team = thread_pool_team(pool);
    float *pixel;
    const struct rank_work work = {.n_task = n_task,
                                   .most_bytes = task_pixels(r, 0, &pixel),
                                   .run = run_task,
                                   .pack = pack_task,
                                   .unpack = unpack_task,
                                   .context = r};
    if (team == NULL || !rank_orders_can_share(r->q->configuration, 1, &r->q->input))
        return thread_pool_run(pool, n_task, run_task, r, r->progress);
    status st = rank_team_rank(team) == 0 ? rank_orders_picture(team, r->q, err) : STATUS_OK;
    return st == STATUS_OK ? rank_team_share(team, &work, pool, r->progress, err) : st;
}

/* One block: the array of pointers, then the texts. */
static status name_channels(const struct radiance_source *source, struct image *im, struct error *err)
{
    static const char channel[] = "RGB";
    size_t n = im->n_channel;
    // cppcheck-suppress pointerSize ; pointers and texts lie in one block
    char *block = calloc(n, sizeof(char *) + NAME_BYTES), flat[RADIANCE_NAME_BYTES];
    if (block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot render: out of memory");
    const char **name = (const char **)(void *)block;
    for (size_t i = 0; i < n; i++) {
        char *text = block + n * sizeof(char *) + i * NAME_BYTES;
        if (i < 3)
            snprintf(text, NAME_BYTES, "%c", channel[i]);
        else if (i < 6)
            snprintf(text, NAME_BYTES, "var.%c", channel[i - 3]);
        else {
            radiance_derivative_name(source, (i - 6) / 3, flat);
            snprintf(text, NAME_BYTES, "d_%s.%c", flat, channel[i % 3]);
        }
        name[i] = text;
    }
    im->channel_name = name;
    im->name_storage = block;
    return STATUS_OK;
}

static status check_finite(const struct image *im, const char *id, struct error *err)
{
    for (size_t i = 0; i < im->width * im->height; i++)
        for (size_t k = 0; k < im->n_channel; k++)
            if ((k < 3 || k >= 6) && !isfinite(im->pixel[i * im->n_channel + k]))
                return error_set(err, STATUS_NUMERIC,
                                 "model '%s' gave a value that is not finite in pixel %zu, %zu (%s)", id, i % im->width,
                                 i / im->width, im->channel_name[k]);
    return STATUS_OK;
}

static status check_request(const struct render_request *q, struct error *err)
{
    if (q->n_sample == 0 || q->n_sample > UINT32_MAX || q->first_sample > UINT32_MAX - q->n_sample || q->width == 0 ||
        q->height == 0 || q->width > 65536 || q->height > 65536 || q->stream > 4095)
        return error_set(err, STATUS_INVALID, "cannot render %zu x %zu pixels with %zu samples in stream %u", q->width,
                         q->height, q->n_sample, q->stream);
    return configuration_check(q->configuration, 1, err);
}

/* The picture of a helper lacks what other ranks have rendered. */
static bool is_helper(const struct thread_pool *pool)
{
    const struct rank_team *team = thread_pool_team(pool);
    return team != NULL && rank_team_rank(team) > 0;
}

static status render_pixels(struct run *r, struct thread_pool *pool, struct error *err)
{
    const struct render_request *q = r->q;
    size_t n_task = (r->n_pixel + r->pixels_per_task - 1) / r->pixels_per_task;
    status st = image_init(r->im, q->width, q->height, 6 + 3 * r->source->n_flat, err);
    if (st == STATUS_OK) st = name_channels(r->source, r->im, err);
    if (st == STATUS_OK) {
        st = run_tasks(r, n_task, pool, err);
        if (st == STATUS_OK && progress_cancelled(r->progress)) st = STATUS_CANCELLED;
        if (st == STATUS_CANCELLED) error_set(err, st, "rendering was cancelled");
    }
    if (st == STATUS_OK && !is_helper(pool)) st = check_finite(r->im, q->input.model->id, err);
    if (st != STATUS_OK) image_release(r->im);
    return st;
}

status render_run(const struct render_request *q, struct thread_pool *pool, const struct progress *progress,
                  struct image *im, struct error *err)
{
    struct radiance_source source;
    struct run r = {.q = q, .source = &source, .progress = progress, .im = im, .n_pixel = q->width * q->height};
    memset(im, 0, sizeof *im);
    status st = check_request(q, err);
    struct radiance_input in = q->input;
    in.pixel_m = q->configuration->crop_m / (double)q->width;
    if (st == STATUS_OK) st = radiance_source_init(&source, &in, q->configuration, 1, err);
    if (st != STATUS_OK) return st;
    r.pixels_per_task = q->n_sample < TASK_SAMPLES ? TASK_SAMPLES / q->n_sample : 1;
    st = render_pixels(&r, pool, err);
    radiance_source_release(&source);
    return st;
}
