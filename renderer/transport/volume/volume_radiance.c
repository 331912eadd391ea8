#include "renderer/transport/volume/volume_radiance.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/volume/volume_bent.h"
#include "renderer/transport/volume/volume_tracer.h"

#include <stdlib.h>
#include <string.h>

struct volume_state {
    struct volume_parameters parameters; /* owns its phase state */
    const struct volume_scene *scene;
    size_t n_jac;
    struct volume_setting *setting; /* per configuration */
    struct camera *camera;          /* per configuration */
};

static void release(void *state)
{
    struct volume_state *s = state;
    if (s->parameters.state != NULL) s->parameters.model->release(s->parameters.state);
    free(s->setting);
    free(s->camera);
    free(s);
}

static status check_input(const struct radiance_input *in, struct error *err)
{
    const struct appearance *m = in->model;
    double d = in->param[m->n_param - 1];
    if (in->n_set > 1)
        return error_set_field(err, STATUS_INVALID, "n_set",
                               "cannot use %zu parameter sets of model '%s': volumes have no material groups",
                               in->n_set, m->id);
    if (in->has_speckle)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s' with speckle: it has none",
                               m->id);
    if (in->want_derivative && in->scene.volume->bent != NULL)
        return error_set(err, STATUS_INVALID, "a bent volume is traced without derivatives");
    if (d > 0 && d <= 1e9) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, m->param[m->n_param - 1].name,
                           "cannot trace with density multiplier %g per metre", d);
}

static status prepare(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err)
{
    status st = check_input(in, err);
    if (st != STATUS_OK) return st;
    struct volume_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot trace a volume: out of memory");
    s->scene = in->scene.volume;
    s->n_jac = in->want_derivative ? 3 * in->model->n_param : 0;
    s->parameters.model = in->model->volume;
    s->parameters.multiplier_per_m = in->param[in->model->n_param - 1];
    s->setting = malloc((n_configuration + 1) * sizeof *s->setting);
    s->camera = malloc((n_configuration + 1) * sizeof *s->camera);
    st = s->setting != NULL && s->camera != NULL
             ? s->parameters.model->prepare(in->param, &s->parameters.state, err)
             : error_set(err, STATUS_NO_MEMORY, "cannot trace a volume: out of memory");
    if (st != STATUS_OK) {
        release(s);
        return st;
    }
    for (size_t i = 0; i < n_configuration; i++) {
        volume_setting_init(&s->setting[i], s->scene, &s->parameters, &c[i], in->want_derivative);
        camera_init(&s->camera[i], &c[i]);
    }
    *state = s;
    return STATUS_OK;
}

static bool enter(const struct volume_state *s, const struct camera *camera, const double xy[2], struct rng *rng,
                  struct volume_ray *ray)
{
    double at[2], origin_mm[3], direction[3];
    struct camera pinhole;
    camera_blur(camera, xy, rng, at);
    camera = camera_through_lens(camera, rng, &pinhole, at);
    camera_origin(camera, at, origin_mm);
    camera_direction(camera, at, direction);
    return volume_ray_enter(s->scene, origin_mm, direction, ray);
}

/* The same of a bent cloth, path by path. */
static uint64_t trace_bent(const struct volume_state *s, const struct radiance_block *b, float *value)
{
    const struct camera *camera = &s->camera[b->member[0]];
    uint64_t n_bounce = 0;
    for (size_t i = 0; i < b->n_path && !progress_cancelled(b->progress); i++) {
        struct volume_result path;
        struct camera pinhole;
        double at[2], origin_mm[3], direction[3];
        camera_blur(camera, b->xy[i], &b->rng[i], at);
        const struct camera *from = camera_through_lens(camera, &b->rng[i], &pinhole, at);
        camera_origin(from, at, origin_mm);
        camera_direction(from, at, direction);
        volume_bent_trace(&s->setting[b->member[0]], origin_mm, direction, &b->rng[i], &path);
        memcpy(value + i * (3 + s->n_jac), path.radiance, sizeof path.radiance);
        n_bounce += path.n_bounce;
    }
    return n_bounce;
}

static uint64_t trace(const void *state, const struct radiance_block *b, float *value)
{
    const struct volume_state *s = state;
    if (s->scene->bent != NULL) return trace_bent(s, b, value);
    struct volume_ray ray[RADIANCE_BLOCK_PATHS];
    struct volume_result path[RADIANCE_BLOCK_PATHS];
    size_t n_ray = 0, place[RADIANCE_BLOCK_PATHS];
    uint64_t n_bounce = 0;
    for (size_t i = 0; i < b->n_path; i++) {
        if (!enter(s, &s->camera[b->member[0]], b->xy[i], &b->rng[i], &ray[n_ray])) continue; /* sees nothing: adds 0 */
        b->rng[n_ray] = b->rng[i];
        place[n_ray++] = i;
    }
    volume_trace_many(&s->setting[b->member[0]], n_ray, ray, b->rng, path);
    for (size_t i = 0; i < n_ray; i++) {
        float *v = value + place[i] * (3 + s->n_jac);
        memcpy(v, path[i].radiance, sizeof path[i].radiance);
        memcpy(v + 3, path[i].jac, s->n_jac * sizeof *v);
        n_bounce += path[i].n_bounce;
    }
    return n_bounce;
}

static void record_path(const void *state, size_t i_configuration, const double xy[2], struct rng *rng,
                        struct radiance_record *record, float *value)
{
    const struct volume_state *s = state;
    struct volume_result path;
    struct volume_ray ray;
    struct volume_record events = {0, record->capacity, record->entry};
    record->n_entry = record->n_bounce = 0;
    if (!enter(s, &s->camera[i_configuration], xy, rng, &ray)) return;
    volume_trace(&s->setting[i_configuration], &ray, rng, &path, &events);
    record->n_entry = events.n_event;
    record->n_bounce = events.n_event / 4; /* look-ups are cheap beside scattering */
    memcpy(value, path.radiance, sizeof path.radiance);
    memcpy(value + 3, path.jac, s->n_jac * sizeof *value);
}

static double replay(const void *at, const void *traced, const struct radiance_record *record)
{
    const struct volume_state *now = at, *then = traced;
    const struct volume_record events = {record->n_entry, record->capacity, record->entry};
    return volume_replay(now->scene, &now->parameters, &then->parameters, &events);
}

const struct radiance_tracer volume_radiance = {.max_path = RADIANCE_BLOCK_PATHS,
                                                .max_member = 1,
                                                .entry_bytes = sizeof(struct volume_event),
                                                .prepare = prepare,
                                                .release = release,
                                                .trace = trace,
                                                .record = record_path,
                                                .replay = replay};
