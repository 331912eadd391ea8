#include "renderer/transport/volume_estimate.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/volume_tracer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct run {
    const struct volume_estimate_request *q;
    struct volume_setting *setting; /* per configuration */
    struct camera *camera;
};

static uint64_t trace(void *context, size_t i_configuration, double (*xy)[2], struct rng *rng, float *value)
{
    const struct run *r = context;
    const struct camera *camera = &r->camera[i_configuration];
    struct volume_ray ray[ESTIMATE_BLOCK_PATHS];
    struct volume_result path[ESTIMATE_BLOCK_PATHS];
    size_t n = 0, place[ESTIMATE_BLOCK_PATHS], n_jac = r->q->want_jacobian ? 3 * (r->q->model->n_param + 1) : 0;
    uint64_t n_vertex = 0;
    for (size_t i = 0; i < ESTIMATE_BLOCK_PATHS; i++) {
        double origin_mm[3], direction[3];
        camera_origin(camera, xy[i][0], xy[i][1], origin_mm);
        camera_direction(camera, xy[i][0], xy[i][1], direction);
        if (!volume_ray_enter(r->q->scene, origin_mm, direction, &ray[n])) continue; /* sees nothing: adds 0 */
        rng[n] = rng[i];
        place[n++] = i;
    }
    volume_trace_many(&r->setting[i_configuration], n, ray, rng, path);
    for (size_t i = 0; i < n; i++) {
        float *v = value + place[i] * (3 + n_jac);
        memcpy(v, path[i].radiance, sizeof path[i].radiance);
        memcpy(v + 3, path[i].jac, n_jac * sizeof *v);
        n_vertex += path[i].n_vertex;
    }
    return n_vertex;
}

static status numeric_error(const struct volume_estimate_request *q, size_t i_configuration, size_t i_value,
                            struct error *err)
{
    const char *name = "";
    if (i_value >= 3) {
        size_t p = (i_value - 3) % (q->model->n_param + 1);
        name = p < q->model->n_param ? q->model->param[p].name : "d";
    }
    return error_set_field(err, STATUS_NUMERIC, name,
                           "phase function '%s' gave a value that is not finite in configuration %zu (%s)",
                           q->model->id, i_configuration, name[0] != '\0' ? name : "radiance");
}

status volume_estimate_run(const struct volume_estimate_request *q, struct thread_pool *pool,
                           const struct progress *progress, struct estimate *out, struct error *err)
{
    struct phase_state *state = NULL;
    struct run r = {.q = q};
    size_t bad_configuration = 0, bad_value = 0;
    status st = estimate_check_configurations(q->configuration, q->n_configuration, q->iteration, q->replica, err);
    if (st != STATUS_OK) return st;
    if (!(q->multiplier_per_m > 0 && q->multiplier_per_m <= 1e9))
        return error_set_field(err, STATUS_INVALID, "d", "cannot trace with density multiplier %g per metre",
                               q->multiplier_per_m);
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
