#include "renderer/transport/volume_render.h"

#include "renderer/scattering/appearance.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/render_pixels.h"
#include "renderer/transport/volume/volume_tracer.h"

#include <stdio.h>
#include <string.h>

struct run {
    const struct volume_render_request *q;
    struct volume_setting setting;
    struct camera camera;
};

static void trace(void *context, size_t n, double (*xy)[2], struct rng *rng, float *value)
{
    const struct run *r = context;
    volume_trace_camera(&r->setting, &r->camera, n, xy, rng, value);
}

static void name(void *context, size_t i_flat, char text[RENDER_NAME_BYTES])
{
    const struct phase_model *m = ((const struct run *)context)->q->model;
    const char *param = i_flat < m->n_param ? m->param[i_flat].name : APPEARANCE_DENSITY_MULTIPLIER;
    snprintf(text, RENDER_NAME_BYTES, "d_%s", param);
}

status volume_render_run(const struct volume_render_request *q, struct thread_pool *pool,
                         const struct progress *progress, struct image *im, struct error *err)
{
    struct run r = {.q = q};
    struct phase_state *state = NULL;
    const struct render_pixels p = {.width = q->width,
                                    .height = q->height,
                                    .n_sample = q->n_sample,
                                    .seed = q->seed,
                                    .stream = q->stream,
                                    .n_flat = q->want_derivative ? q->model->n_param + 1 : 0,
                                    .id = q->model->id,
                                    .trace = trace,
                                    .name = name,
                                    .context = &r};
    memset(im, 0, sizeof *im);
    status st = render_pixels_check(&p, err);
    if (st == STATUS_OK) st = estimate_check_configurations(q->configuration, 1, 0, 0, err);
    if (st == STATUS_OK) st = volume_check_multiplier(q->multiplier_per_m, err);
    if (st == STATUS_OK) st = q->model->prepare(q->param, &state, err);
    if (st != STATUS_OK) return st;
    volume_setting_init(&r.setting, q->scene, q->model, state, q->multiplier_per_m, q->configuration,
                        q->want_derivative);
    camera_init(&r.camera, q->configuration);
    st = render_pixels_run(&p, pool, progress, im, err);
    q->model->release(state);
    return st;
}
