#include "renderer/transport/estimate.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/path_tracer.h"

#include <stdlib.h>
#include <string.h>

struct run {
    const struct estimate_request *q;
    struct path_setting *setting; /* per configuration */
    struct camera *camera;
    size_t n_jac;
};

static uint32_t trace(void *context, size_t i_configuration, double x, double y, struct rng *rng, float *value)
{
    const struct run *r = context;
    struct scene_ray ray;
    struct path_result path;
    if (!camera_ray(&r->camera[i_configuration], r->q->scene, x, y, &ray)) return 0; /* sees nothing: adds 0 */
    path_trace(&r->setting[i_configuration], &ray, rng, &path, NULL);
    memcpy(value, path.radiance, sizeof path.radiance);
    memcpy(value + 3, path.jac, r->n_jac * sizeof *value);
    return path.n_vertex;
}

static status numeric_error(const struct scattering_model *m, size_t i_configuration, size_t i_value, struct error *err)
{
    const char *name = i_value < 3 ? "" : m->param[(i_value - 3) % m->n_param].name;
    return error_set_field(err, STATUS_NUMERIC, name,
                           "scattering model '%s' gave a value that is not finite in configuration %zu (%s)", m->id,
                           i_configuration, name[0] != '\0' ? name : "radiance");
}

status estimate_run(const struct estimate_request *q, struct thread_pool *pool, const struct progress *progress,
                    struct estimate *out, struct error *err)
{
    struct parameter_sets sets;
    struct run r = {.q = q};
    size_t bad_configuration = 0, bad_value = 0;
    status st = estimate_check_configurations(q->configuration, q->n_configuration, q->iteration, q->replica, err);
    if (st != STATUS_OK) return st;
    st = parameter_sets_init(&sets, q->scene, q->model, q->param, q->n_set, err);
    if (st != STATUS_OK) goto out;
    r.n_jac = q->want_jacobian ? 3 * sets.n * q->model->n_param : 0;
    r.setting = malloc((q->n_configuration + 1) * sizeof *r.setting);
    r.camera = malloc((q->n_configuration + 1) * sizeof *r.camera);
    if (r.setting == NULL || r.camera == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
        goto out;
    }
    for (size_t i = 0; i < q->n_configuration; i++) {
        path_setting_init_sets(&r.setting[i], q->scene, &sets, &q->configuration[i], q->want_jacobian);
        camera_init(&r.camera[i], &q->configuration[i]);
    }
    const struct estimate_blocks blocks = {.n_configuration = q->n_configuration,
                                           .n_path = q->n_path,
                                           .seed = q->seed,
                                           .iteration = q->iteration,
                                           .replica = q->replica,
                                           .n_jac = r.n_jac,
                                           .trace = trace,
                                           .context = &r};
    st = estimate_blocks_run(&blocks, pool, progress, out, &bad_configuration, &bad_value, err);
    if (st == STATUS_NUMERIC) st = numeric_error(q->model, bad_configuration, bad_value, err);
out:
    free(r.camera);
    free(r.setting);
    parameter_sets_release(&sets);
    return st;
}
