#include "renderer/transport/appearance_estimate.h"

#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/rotation_mean.h"
#include "renderer/transport/volume_estimate.h"

static status estimate_surface(const struct appearance_request *q, struct thread_pool *pool,
                               const struct progress *progress, struct estimate *out, struct error *err)
{
    const struct estimate_request request = {.scene = q->scene.fibers,
                                             .model = q->model->surface,
                                             .param = q->param,
                                             .configuration = q->configuration,
                                             .n_configuration = q->n_configuration,
                                             .n_path = q->n_path,
                                             .seed = q->seed,
                                             .iteration = q->iteration,
                                             .replica = q->replica,
                                             .want_jacobian = q->want_jacobian,
                                             .no_probes = q->no_probes};
    return estimate_run(&request, pool, progress, out, err);
}

static status estimate_volume(const struct appearance_request *q, struct thread_pool *pool,
                              const struct progress *progress, struct estimate *out, struct error *err)
{
    const struct volume_estimate_request request = {.scene = q->scene.volume,
                                                    .model = q->model->volume,
                                                    .param = q->param,
                                                    .multiplier_per_m = q->param[q->model->n_param - 1],
                                                    .configuration = q->configuration,
                                                    .n_configuration = q->n_configuration,
                                                    .n_path = q->n_path,
                                                    .seed = q->seed,
                                                    .iteration = q->iteration,
                                                    .replica = q->replica,
                                                    .want_jacobian = q->want_jacobian};
    return volume_estimate_run(&request, pool, progress, out, err);
}

status appearance_scene_check(const struct appearance_scene *scene, const struct appearance *model, const char *what,
                              struct error *err)
{
    bool surface = model->kind == APPEARANCE_SURFACE;
    if (surface ? scene->fibers != NULL : scene->volume != NULL) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "model", "cannot %s model '%s': the cloth has no %s", what, model->id,
                           surface ? "fibers" : "density volume");
}

static status estimate_any(const struct appearance_request *q, struct thread_pool *pool,
                           const struct progress *progress, struct estimate *out, struct error *err)
{
    return q->model->kind == APPEARANCE_SURFACE ? estimate_surface(q, pool, progress, out, err)
                                                : estimate_volume(q, pool, progress, out, err);
}

static status estimate_rotations(const struct appearance_request *q, struct thread_pool *pool,
                                 const struct progress *progress, struct estimate *out, struct error *err)
{
    struct rotation_mean mean;
    struct appearance_request turned = *q;
    status s = rotation_mean_init(&mean, q->configuration, q->n_path, q->n_configuration, err);
    turned.configuration = mean.turned;
    turned.n_configuration = mean.n_turned;
    turned.n_path = mean.n_path;
    if (s == STATUS_OK) s = estimate_any(&turned, pool, progress, mean.estimate, err);
    if (s == STATUS_OK) rotation_mean_take(&mean, out);
    rotation_mean_release(&mean);
    return s;
}

status appearance_estimate_run(const struct appearance_request *q, struct thread_pool *pool,
                               const struct progress *progress, struct estimate *out, struct error *err)
{
    status s = appearance_scene_check(&q->scene, q->model, "render", err);
    if (s != STATUS_OK) return s;
    if (rotation_mean_wanted(q->configuration, q->n_configuration))
        return estimate_rotations(q, pool, progress, out, err);
    return estimate_any(q, pool, progress, out, err);
}

size_t appearance_n_path(const struct configuration *c, size_t n_path)
{
    size_t n_cell = (size_t)c->contrast_cells * c->contrast_cells, n_rotation = c->n_rotation > 1 ? c->n_rotation : 1;
    size_t n_part = n_cell > 0 ? n_cell : n_rotation, part = (n_path + n_part - 1) / n_part;
    if (n_cell > 0)
        return n_cell * (part > 4 ? part + part % 2 : 4); /* two sets of two paths at least: contrast_plan_init */
    return n_rotation * ((part + ESTIMATE_BLOCK_PATHS - 1) / ESTIMATE_BLOCK_PATHS * ESTIMATE_BLOCK_PATHS);
}
