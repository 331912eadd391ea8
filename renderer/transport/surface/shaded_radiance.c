#include "renderer/transport/surface/shaded_radiance.h"
#include "renderer/scene/scene_glint.h"
#include "renderer/transport/camera.h"

#include <stdlib.h>

struct shaded_state {
    const struct shaded_method *method;
    struct parameter_sets sets;
    size_t n_setting;       /* whose init was called */
    unsigned char *setting; /* per configuration, setting_bytes each */
    struct camera *camera;  /* per configuration */
};

static void *setting_at(const struct shaded_state *s, size_t i) { return s->setting + i * s->method->setting_bytes; }

void shaded_release(void *state)
{
    struct shaded_state *s = state;
    for (size_t i = 0; i < s->n_setting && s->method->release != NULL; i++) s->method->release(setting_at(s, i));
    parameter_sets_release(&s->sets);
    free(s->setting);
    free(s->camera);
    free(s);
}

static status check(const struct shaded_method *m, const struct radiance_input *in, struct error *err)
{
    if (in->want_derivative)
        return error_set(err, STATUS_INVALID, "cannot render by %s with derivatives: there are none", m->name);
    if (in->discrepancy != NULL)
        return error_set(err, STATUS_INVALID, "cannot render by %s with a discrepancy: path tracing alone has it",
                         m->name);
    if (in->has_speckle)
        return error_set(err, STATUS_INVALID, "cannot render by %s with speckle: path tracing alone has it", m->name);
    if (scattering_frame_reason(in->model->surface) != NULL)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s' by %s: %s", in->model->id,
                               m->name, scattering_frame_reason(in->model->surface));
    return m->check(in, err);
}

status shaded_prepare(const struct shaded_method *m, const struct radiance_input *in, const struct configuration *c,
                      size_t n_configuration, void **state, struct error *err)
{
    status st = check(m, in, err);
    if (st != STATUS_OK) return st;
    struct shaded_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot render by %s: out of memory", m->name);
    s->method = m;
    s->setting = calloc(n_configuration + 1, m->setting_bytes);
    s->camera = calloc(n_configuration + 1, sizeof *s->camera);
    st = s->setting != NULL && s->camera != NULL
             ? parameter_sets_init(&s->sets, in->scene.fibers, in->model->surface, in->param, in->n_set, err)
             : error_set(err, STATUS_NO_MEMORY, "cannot render by %s: out of memory", m->name);
    if (st == STATUS_OK && in->pixel_m > 0) st = scene_glints_make(in->scene.fibers, err);
    for (size_t i = 0; i < n_configuration && st == STATUS_OK; i++) {
        struct path_setting *path = setting_at(s, i);
        path_setting_init_sets(path, in->scene.fibers, &s->sets, &c[i], false);
        path->pixel_um = path_setting_pixel_um(in->pixel_m);
        if (in->plain_paths) path->guided_paths = path->has_strips = false;
        camera_init(&s->camera[i], &c[i]);
        s->n_setting = i + 1;
        st = m->init(path, in, err);
    }
    if (st == STATUS_OK)
        *state = s;
    else
        shaded_release(s);
    return st;
}

uint64_t shaded_trace(const void *state, const struct radiance_block *b, float *value)
{
    const struct shaded_state *s = state;
    const struct path_setting *setting = setting_at(s, b->member[0]);
    const struct camera *camera = &s->camera[b->member[0]];
    uint64_t n_bounce = 0;
    for (size_t i = 0; i < b->n_path; i++) {
        struct scene_ray ray;
        struct camera pinhole;
        double xy[2];
        if (progress_cancelled(b->progress)) break;
        camera_blur(camera, b->xy[i], &b->rng[i], xy);
        if (!camera_ray(camera_through_lens(camera, &b->rng[i], &pinhole, xy), setting->scene, xy, &ray)) continue;
        n_bounce += s->method->shade(setting, &ray, &b->rng[i], value + 3 * i);
    }
    return n_bounce;
}

void shaded_record_nothing(const void *state, size_t i_configuration, const double xy[2], struct rng *rng,
                           struct radiance_record *record, float *value)
{
    (void)state, (void)i_configuration, (void)xy, (void)rng, (void)value;
    record->n_entry = record->n_bounce = 0;
}

double shaded_replay_nothing(const void *at, const void *traced, const struct radiance_record *record)
{
    (void)at, (void)traced, (void)record;
    return 0.0;
}
