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
                                           .stream = q->stream,
                                           .want_derivative = q->want_derivative};
    return render_run(&request, pool, progress, im, err);
}
