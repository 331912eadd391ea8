#include "renderer/transport/render.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/path_tracer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TASK_SAMPLES = 512, NAME_BYTES = 64 };
/* apart from estimate.h, which counts iterations upwards from 0 */
enum { RENDER_ITERATION = 65535, RENDER_REPLICA = 15 };

struct run {
    const struct render_request *q;
    const struct progress *progress;
    struct path_setting setting;
    struct camera camera;
    struct image *im;
    size_t pixels_per_task, n_pixel, n_flat;
};

static void render_pixel(struct run *r, size_t i_pixel)
{
    const struct render_request *q = r->q;
    const struct rng_key key = {q->seed, RENDER_ITERATION, RENDER_REPLICA, q->stream};
    size_t n_flat = r->n_flat, n_jac = q->want_derivative ? 3 * n_flat : 0;
    double x[3 + PATH_N_DERIVATIVE] = {0}, x2[3] = {0}, n = (double)q->n_sample;
    for (size_t i = 0; i < q->n_sample; i++) {
        struct rng rng;
        struct scene_ray ray;
        struct path_result path;
        rng_start(&rng, &key, (uint32_t)i_pixel, (uint32_t)i);
        double px = ((double)(i_pixel % q->width) + rng_double(&rng)) / (double)q->width;
        double py = ((double)(i_pixel / q->width) + rng_double(&rng)) / (double)q->height;
        if (!camera_ray(&r->camera, q->scene, px, py, &ray)) continue;
        path_trace(&r->setting, &ray, &rng, &path, NULL);
        for (size_t k = 0; k < 3; k++) {
            x[k] += (double)path.radiance[k];
            x2[k] += (double)path.radiance[k] * (double)path.radiance[k];
        }
        for (size_t k = 0; k < n_jac; k++) x[3 + k] += (double)path.jac[k];
    }
    float *out = r->im->pixel + i_pixel * r->im->n_channel;
    for (size_t k = 0; k < 3; k++) {
        double mean = x[k] / n;
        out[k] = (float)mean;
        out[3 + k] = q->n_sample > 1 ? (float)(fmax(0, x2[k] - x[k] * mean) / (n * (n - 1))) : INFINITY;
    }
    for (size_t k = 0; k < n_jac; k++) out[6 + 3 * (k % n_flat) + k / n_flat] = (float)(x[3 + k] / n);
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    size_t first = i_task * r->pixels_per_task, last = first + r->pixels_per_task;
    for (size_t i = first; i < last && i < r->n_pixel && !progress_cancelled(r->progress); i++) render_pixel(r, i);
}

/* One block: the array of pointers, then the texts. */
static status name_channels(struct image *im, const struct scattering_model *m, size_t n_set, struct error *err)
{
    static const char channel[] = "RGB";
    size_t n = im->n_channel;
    char *block = calloc(n, sizeof(char *) + NAME_BYTES);
    if (block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot render: out of memory");
    const char **name = (const char **)(void *)block;
    for (size_t i = 0; i < n; i++) {
        char *text = block + n * sizeof(char *) + i * NAME_BYTES;
        if (i < 3)
            snprintf(text, NAME_BYTES, "%c", channel[i]);
        else if (i < 6)
            snprintf(text, NAME_BYTES, "var.%c", channel[i - 3]);
        else if (n_set == 1)
            snprintf(text, NAME_BYTES, "d_%s.%c", m->param[(i - 6) / 3].name, channel[i % 3]);
        else
            snprintf(text, NAME_BYTES, "d_set%zu.%s.%c", (i - 6) / 3 / m->n_param, m->param[(i - 6) / 3 % m->n_param].name,
                     channel[i % 3]);
        name[i] = text;
    }
    im->channel_name = name;
    im->name_storage = block;
    return STATUS_OK;
}

static status check_finite(const struct image *im, const struct scattering_model *m, struct error *err)
{
    for (size_t i = 0; i < im->width * im->height; i++)
        for (size_t k = 0; k < im->n_channel; k++)
            if ((k < 3 || k >= 6) && !isfinite(im->pixel[i * im->n_channel + k]))
                return error_set(err, STATUS_NUMERIC,
                                 "scattering model '%s' gave a value that is not finite in pixel %zu, %zu (%s)", m->id,
                                 i % im->width, i / im->width, im->channel_name[k]);
    return STATUS_OK;
}

status render_run(const struct render_request *q, struct thread_pool *pool, const struct progress *progress,
                  struct image *im, struct error *err)
{
    struct parameter_sets sets;
    memset(im, 0, sizeof *im);
    if (q->n_sample == 0 || q->n_sample > UINT32_MAX || q->width == 0 || q->height == 0 || q->width > 65536 ||
        q->height > 65536 || q->stream > 4095)
        return error_set(err, STATUS_INVALID, "cannot render %zu x %zu pixels with %zu samples in stream %u", q->width,
                         q->height, q->n_sample, q->stream);
    status st = parameter_sets_init(&sets, q->scene, q->model, q->param, q->n_set, err);
    if (st != STATUS_OK) {
        parameter_sets_release(&sets);
        return st;
    }
    struct run r = {.q = q, .progress = progress, .im = im, .n_pixel = q->width * q->height};
    r.n_flat = sets.n * q->model->n_param;
    r.pixels_per_task = q->n_sample < TASK_SAMPLES ? TASK_SAMPLES / q->n_sample : 1;
    path_setting_init_sets(&r.setting, q->scene, &sets, q->configuration, q->want_derivative);
    camera_init(&r.camera, q->configuration);
    st = image_init(im, q->width, q->height, 6 + (q->want_derivative ? 3 * r.n_flat : 0), err);
    if (st == STATUS_OK) st = name_channels(im, q->model, sets.n, err);
    if (st == STATUS_OK) {
        st = thread_pool_run(pool, (r.n_pixel + r.pixels_per_task - 1) / r.pixels_per_task, run_task, &r, progress);
        if (st == STATUS_OK && progress_cancelled(progress)) st = STATUS_CANCELLED;
        if (st != STATUS_OK) error_set(err, st, "rendering was cancelled");
    }
    if (st == STATUS_OK) st = check_finite(im, q->model, err);
    if (st != STATUS_OK) image_release(im);
    parameter_sets_release(&sets);
    return st;
}
