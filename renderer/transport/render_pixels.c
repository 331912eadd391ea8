#include "renderer/transport/render_pixels.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TASK_SAMPLES = 512, NAME_BYTES = RENDER_NAME_BYTES + 8, N_VALUE = 3 + 3 * SCATTERING_MAX_FLAT };
/* apart from estimate.h, which counts iterations upwards from 0 */
enum { RENDER_ITERATION = 65535, RENDER_REPLICA = 15 };

struct run {
    const struct render_pixels *p;
    const struct progress *progress;
    struct image *im;
    size_t pixels_per_task, n_pixel;
};

/* Adds n samples of a pixel, from number `first`. */
static void add_samples(const struct render_pixels *p, size_t i_pixel, size_t first, size_t n, double *x, double *x2)
{
    const struct rng_key key = {p->seed, RENDER_ITERATION, RENDER_REPLICA, p->stream};
    size_t n_value = 3 + 3 * p->n_flat;
    struct rng rng[RENDER_CHUNK];
    double xy[RENDER_CHUNK][2];
    float value[RENDER_CHUNK * N_VALUE];
    memset(value, 0, n * n_value * sizeof *value);
    for (size_t i = 0; i < n; i++) {
        rng_start(&rng[i], &key, (uint32_t)i_pixel, (uint32_t)(first + i));
        xy[i][0] = ((double)(i_pixel % p->width) + rng_double(&rng[i])) / (double)p->width;
        xy[i][1] = ((double)(i_pixel / p->width) + rng_double(&rng[i])) / (double)p->height;
    }
    p->trace(p->context, n, xy, rng, value);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n_value; k++) {
            double v = (double)value[i * n_value + k];
            x[k] += v;
            if (k < 3) x2[k] += v * v;
        }
}

static void render_pixel(struct run *r, size_t i_pixel)
{
    const struct render_pixels *p = r->p;
    double x[N_VALUE] = {0}, x2[3] = {0}, n = (double)p->n_sample;
    for (size_t i = 0; i < p->n_sample; i += RENDER_CHUNK) {
        if (progress_cancelled(r->progress)) return;
        add_samples(p, i_pixel, i, p->n_sample - i < RENDER_CHUNK ? p->n_sample - i : RENDER_CHUNK, x, x2);
    }
    float *out = r->im->pixel + i_pixel * r->im->n_channel;
    for (size_t k = 0; k < 3; k++) {
        double mean = x[k] / n;
        out[k] = (float)mean;
        out[3 + k] = p->n_sample > 1 ? (float)(fmax(0, x2[k] - x[k] * mean) / (n * (n - 1))) : INFINITY;
    }
    for (size_t k = 0; k < 3 * p->n_flat; k++) out[6 + 3 * (k % p->n_flat) + k / p->n_flat] = (float)(x[3 + k] / n);
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    size_t first = i_task * r->pixels_per_task, last = first + r->pixels_per_task;
    for (size_t i = first; i < last && i < r->n_pixel && !progress_cancelled(r->progress); i++) render_pixel(r, i);
}

/* One block: the array of pointers, then the texts. */
static status name_channels(const struct render_pixels *p, struct image *im, struct error *err)
{
    static const char channel[] = "RGB";
    size_t n = im->n_channel;
    char *block = calloc(n, sizeof(char *) + NAME_BYTES), flat[RENDER_NAME_BYTES];
    if (block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot render: out of memory");
    const char **name = (const char **)(void *)block;
    for (size_t i = 0; i < n; i++) {
        char *text = block + n * sizeof(char *) + i * NAME_BYTES;
        if (i < 3)
            snprintf(text, NAME_BYTES, "%c", channel[i]);
        else if (i < 6)
            snprintf(text, NAME_BYTES, "var.%c", channel[i - 3]);
        else {
            p->name(p->context, (i - 6) / 3, flat);
            snprintf(text, NAME_BYTES, "%s.%c", flat, channel[i % 3]);
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
                                 "scattering model '%s' gave a value that is not finite in pixel %zu, %zu (%s)", id,
                                 i % im->width, i / im->width, im->channel_name[k]);
    return STATUS_OK;
}

status render_pixels_check(const struct render_pixels *p, struct error *err)
{
    if (p->n_sample == 0 || p->n_sample > UINT32_MAX || p->width == 0 || p->height == 0 || p->width > 65536 ||
        p->height > 65536 || p->stream > 4095)
        return error_set(err, STATUS_INVALID, "cannot render %zu x %zu pixels with %zu samples in stream %u", p->width,
                         p->height, p->n_sample, p->stream);
    return STATUS_OK;
}

status render_pixels_run(const struct render_pixels *p, struct thread_pool *pool, const struct progress *progress,
                         struct image *im, struct error *err)
{
    struct run r = {.p = p, .progress = progress, .im = im, .n_pixel = p->width * p->height};
    memset(im, 0, sizeof *im);
    status st = render_pixels_check(p, err);
    if (st != STATUS_OK) return st;
    r.pixels_per_task = p->n_sample < TASK_SAMPLES ? TASK_SAMPLES / p->n_sample : 1;
    st = image_init(im, p->width, p->height, 6 + 3 * p->n_flat, err);
    if (st == STATUS_OK) st = name_channels(p, im, err);
    if (st == STATUS_OK) {
        st = thread_pool_run(pool, (r.n_pixel + r.pixels_per_task - 1) / r.pixels_per_task, run_task, &r, progress);
        if (st == STATUS_OK && progress_cancelled(progress)) st = STATUS_CANCELLED;
        if (st != STATUS_OK) error_set(err, st, "rendering was cancelled");
    }
    if (st == STATUS_OK) st = check_finite(im, p->id, err);
    if (st != STATUS_OK) image_release(im);
    return st;
}
