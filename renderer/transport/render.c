#include "renderer/transport/render.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/render_pixels.h"
#include "renderer/transport/surface/path_tracer.h"

#include <stdio.h>
#include <string.h>

struct run {
    const struct render_request *q;
    struct path_setting setting;
    struct camera camera;
    size_t n_jac;
};

static void trace(void *context, size_t n, double (*xy)[2], struct rng *rng, float *value)
{
    const struct run *r = context;
    for (size_t i = 0; i < n; i++) {
        struct scene_ray ray;
        struct path_result path;
        float *out = value + i * (3 + r->n_jac);
        if (!camera_ray(&r->camera, r->q->scene, xy[i][0], xy[i][1], &ray)) continue;
        path_trace(&r->setting, &ray, &rng[i], &path, NULL);
        memcpy(out, path.radiance, sizeof path.radiance);
        memcpy(out + 3, path.jac, r->n_jac * sizeof *out);
    }
}

static void name(void *context, size_t i_flat, char text[RENDER_NAME_BYTES])
{
    const struct run *r = context;
    const struct scattering_model *m = r->q->model;
    if (r->setting.n_set == 1)
        snprintf(text, RENDER_NAME_BYTES, "d_%s", m->param[i_flat].name);
    else
        snprintf(text, RENDER_NAME_BYTES, "d_set%zu.%s", i_flat / m->n_param, m->param[i_flat % m->n_param].name);
}

status render_run(const struct render_request *q, struct thread_pool *pool, const struct progress *progress,
                  struct image *im, struct error *err)
{
    struct parameter_sets sets;
    struct run r = {.q = q};
    struct render_pixels p = {.width = q->width,
                              .height = q->height,
                              .n_sample = q->n_sample,
                              .seed = q->seed,
                              .stream = q->stream,
                              .id = q->model->id,
                              .trace = trace,
                              .name = name,
                              .context = &r};
    memset(im, 0, sizeof *im);
    status st = render_pixels_check(&p, err);
    if (st == STATUS_OK) st = estimate_check_configurations(q->configuration, 1, 0, 0, err);
    if (st != STATUS_OK) return st;
    st = parameter_sets_init(&sets, q->scene, q->model, q->param, q->n_set, err);
    if (st == STATUS_OK) {
        p.n_flat = q->want_derivative ? sets.n * q->model->n_param : 0;
        r.n_jac = 3 * p.n_flat;
        path_setting_init_sets(&r.setting, q->scene, &sets, q->configuration, q->want_derivative);
        camera_init(&r.camera, q->configuration);
        st = render_pixels_run(&p, pool, progress, im, err);
    }
    parameter_sets_release(&sets);
    return st;
}
