#include "renderer/transport/appearance_render.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/render.h"
#include "renderer/transport/volume_tracer.h"

#include <math.h>
#include <string.h>

enum { TASK_SAMPLES = 512 };
/* as in render.c */
enum { RENDER_ITERATION = 65535, RENDER_REPLICA = 15 };

static const char *const channel_name[] = {"R", "G", "B", "var.R", "var.G", "var.B"};

struct run {
    const struct appearance_render_request *q;
    const struct progress *progress;
    struct volume_setting setting;
    struct camera camera;
    struct image *im;
    size_t pixels_per_task, n_pixel;
};

static void render_pixel(struct run *r, size_t i_pixel)
{
    const struct appearance_render_request *q = r->q;
    const struct rng_key key = {q->seed, RENDER_ITERATION, RENDER_REPLICA, q->stream};
    double x[3] = {0}, x2[3] = {0}, n = (double)q->n_sample;
    for (size_t i = 0; i < q->n_sample; i++) {
        struct rng rng;
        struct volume_ray ray;
        struct volume_result path;
        double origin_mm[3], direction[3];
        rng_start(&rng, &key, (uint32_t)i_pixel, (uint32_t)i);
        double px = ((double)(i_pixel % q->width) + rng_double(&rng)) / (double)q->width;
        double py = ((double)(i_pixel / q->width) + rng_double(&rng)) / (double)q->height;
        camera_origin(&r->camera, px, py, origin_mm);
        camera_direction(&r->camera, px, py, direction);
        if (!volume_ray_enter(q->scene.volume, origin_mm, direction, &ray)) continue;
        volume_trace(&r->setting, &ray, &rng, &path, NULL);
        for (size_t k = 0; k < 3; k++) {
            x[k] += (double)path.radiance[k];
            x2[k] += (double)path.radiance[k] * (double)path.radiance[k];
        }
    }
    float *out = r->im->pixel + i_pixel * r->im->n_channel;
    for (size_t k = 0; k < 3; k++) {
        double mean = x[k] / n;
        out[k] = (float)mean;
        out[3 + k] = q->n_sample > 1 ? (float)(fmax(0, x2[k] - x[k] * mean) / (n * (n - 1))) : INFINITY;
    }
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct run *r = context;
    size_t first = i_task * r->pixels_per_task, last = first + r->pixels_per_task;
    for (size_t i = first; i < last && i < r->n_pixel && !progress_cancelled(r->progress); i++) render_pixel(r, i);
}

static status check_finite(const struct image *im, const char *id, struct error *err)
{
    for (size_t i = 0; i < im->width * im->height; i++)
        for (size_t k = 0; k < 3; k++)
            if (!isfinite(im->pixel[i * im->n_channel + k]))
                return error_set(err, STATUS_NUMERIC,
                                 "phase function '%s' gave a value that is not finite in pixel %zu, %zu", id,
                                 i % im->width, i / im->width);
    return STATUS_OK;
}

static status render_volume(const struct appearance_render_request *q, struct thread_pool *pool,
                            const struct progress *progress, struct image *im, struct error *err)
{
    const struct phase_model *m = q->model->volume;
    struct run r = {.q = q, .progress = progress, .im = im, .n_pixel = q->width * q->height};
    struct phase_state *state = NULL;
    if (q->n_sample == 0 || q->n_sample > UINT32_MAX || q->width == 0 || q->height == 0 || q->width > 65536 ||
        q->height > 65536 || q->stream > 4095)
        return error_set(err, STATUS_INVALID, "cannot render %zu x %zu pixels with %zu samples in stream %u", q->width,
                         q->height, q->n_sample, q->stream);
    status st = estimate_check_configurations(q->configuration, 1, 0, 0, err);
    if (st == STATUS_OK && q->configuration->environment != NULL)
        st = error_set_field(err, STATUS_UNSUPPORTED, "configuration",
                             "cannot light a volume with an image environment");
    if (st == STATUS_OK) st = m->prepare(q->param, &state, err);
    if (st != STATUS_OK) return st;
    r.pixels_per_task = q->n_sample < TASK_SAMPLES ? TASK_SAMPLES / q->n_sample : 1;
    volume_setting_init(&r.setting, q->scene.volume, m, state, q->param[q->model->n_param - 1], q->configuration,
                        false);
    camera_init(&r.camera, q->configuration);
    st = image_init(im, q->width, q->height, 6, err);
    if (st != STATUS_OK) goto out;
    im->channel_name = channel_name;
    st = thread_pool_run(pool, (r.n_pixel + r.pixels_per_task - 1) / r.pixels_per_task, run_task, &r, progress);
    if (st == STATUS_OK && progress_cancelled(progress)) st = STATUS_CANCELLED;
    if (st != STATUS_OK) error_set(err, st, "rendering was cancelled");
    if (st == STATUS_OK) st = check_finite(im, m->id, err);
    if (st != STATUS_OK) image_release(im);
out:
    m->release(state);
    return st;
}

status appearance_render_run(const struct appearance_render_request *q, struct thread_pool *pool,
                             const struct progress *progress, struct image *im, struct error *err)
{
    memset(im, 0, sizeof *im);
    bool surface = q->model->kind == APPEARANCE_SURFACE;
    if (surface ? q->scene.fibers == NULL : q->scene.volume == NULL)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s': the cloth has no %s",
                               q->model->id, surface ? "fibers" : "density volume");
    if (!surface) return render_volume(q, pool, progress, im, err);
    const struct render_request request = {.scene = q->scene.fibers,
                                           .model = q->model->surface,
                                           .param = q->param,
                                           .configuration = q->configuration,
                                           .width = q->width,
                                           .height = q->height,
                                           .n_sample = q->n_sample,
                                           .seed = q->seed,
                                           .stream = q->stream};
    return render_run(&request, pool, progress, im, err);
}
