#include "renderer/transport/volume_estimate.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/volume/volume_tracer.h"

#include <stdlib.h>

struct run {
    const struct volume_estimate_request *q;
    struct volume_setting *setting; /* per configuration */
    struct camera *camera;
};

static uint64_t trace(void *context, size_t i_configuration, double (*xy)[2], struct rng *rng, float *value)
{
    const struct run *r = context;
    return volume_trace_camera(&r->setting[i_configuration], &r->camera[i_configuration], ESTIMATE_BLOCK_PATHS, xy, rng,
                               value);
}

static status numeric_error(const struct volume_estimate_request *q, size_t i_configuration, size_t i_value,
                            struct error *err)
{
    const char *name = "";
    if (i_value >= 3) {
        size_t p = (i_value - 3) % (q->model->n_param + 1);
        name = p < q->model->n_param ? q->model->param[p].name : "d";
    }
    char view[CONFIGURATION_TEXT];
    configuration_describe(&q->configuration[i_configuration], view);
    return error_set_field(err, STATUS_NUMERIC, name, "phase function '%s' gave a value that is not finite (%s; %s)",
                           q->model->id, name[0] != '\0' ? name : "radiance", view);
}

status volume_check_multiplier(double multiplier_per_m, struct error *err)
{
    if (multiplier_per_m > 0 && multiplier_per_m <= 1e9) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "d", "cannot trace with density multiplier %g per metre",
                           multiplier_per_m);
}

status volume_estimate_run(const struct volume_estimate_request *q, struct thread_pool *pool,
                           const struct progress *progress, struct estimate *out, struct error *err)
{
    struct phase_state *state = NULL;
    struct run r = {.q = q};
    size_t bad_configuration = 0, bad_value = 0;
    status st = estimate_check_configurations(q->configuration, q->n_configuration, q->iteration, q->replica, err);
    if (st != STATUS_OK) return st;
    st = volume_check_multiplier(q->multiplier_per_m, err);
    if (st != STATUS_OK) return st;
    st = q->model->prepare(q->param, &state, err);
    if (st != STATUS_OK) return st;
    r.setting = malloc((q->n_configuration + 1) * sizeof *r.setting);
    r.camera = malloc((q->n_configuration + 1) * sizeof *r.camera);
    if (r.setting == NULL || r.camera == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
        goto out;
    }
    for (size_t i = 0; i < q->n_configuration; i++) {
        volume_setting_init(&r.setting[i], q->scene, q->model, state, q->multiplier_per_m, &q->configuration[i],
                            q->want_jacobian);
        camera_init(&r.camera[i], &q->configuration[i]);
    }
    const struct estimate_blocks blocks = {.n_configuration = q->n_configuration,
                                           .n_path = q->n_path,
                                           .configuration = q->configuration,
                                           .seed = q->seed,
                                           .iteration = q->iteration,
                                           .replica = q->replica,
                                           .n_jac = q->want_jacobian ? 3 * (q->model->n_param + 1) : 0,
                                           .trace_block = trace,
                                           .context = &r};
    st = estimate_blocks_run(&blocks, pool, progress, out, &bad_configuration, &bad_value, err);
    if (st == STATUS_NUMERIC) st = numeric_error(q, bad_configuration, bad_value, err);
out:
    free(r.camera);
    free(r.setting);
    q->model->release(state);
    return st;
}
