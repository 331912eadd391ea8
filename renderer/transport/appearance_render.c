#include "renderer/transport/appearance_render.h"

#include "renderer/transport/render.h"
#include "renderer/transport/volume_render.h"

#include <string.h>

static status render_volume(const struct appearance_render_request *q, struct thread_pool *pool,
                            const struct progress *progress, struct image *im, struct error *err)
{
    const struct volume_render_request request = {.scene = q->scene.volume,
                                                  .model = q->model->volume,
                                                  .param = q->param,
                                                  .multiplier_per_m = q->param[q->model->n_param - 1],
                                                  .configuration = q->configuration,
                                                  .width = q->width,
                                                  .height = q->height,
                                                  .n_sample = q->n_sample,
                                                  .seed = q->seed,
                                                  .stream = q->stream,
                                                  .want_derivative = q->want_derivative};
    return volume_render_run(&request, pool, progress, im, err);
}

status appearance_render_run(const struct appearance_render_request *q, struct thread_pool *pool,
                             const struct progress *progress, struct image *im, struct error *err)
{
    memset(im, 0, sizeof *im);
    status s = appearance_scene_check(&q->scene, q->model, "render", err);
    if (s != STATUS_OK) return s;
    if (q->model->kind == APPEARANCE_VOLUME) return render_volume(q, pool, progress, im, err);
    const struct render_request request = {.scene = q->scene.fibers,
                                           .model = q->model->surface,
                                           .param = q->param,
                                           .configuration = q->configuration,
                                           .width = q->width,
                                           .height = q->height,
                                           .n_sample = q->n_sample,
                                           .seed = q->seed,
                                           .stream = q->stream,
                                           .want_derivative = q->want_derivative};
    return render_run(&request, pool, progress, im, err);
}
