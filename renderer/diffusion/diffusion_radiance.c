#include "renderer/diffusion/diffusion_radiance.h"
#include "renderer/diffusion/diffusion_shade.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/radiance_unrecorded.h"

#include <stdlib.h>

struct diffusion_state {
    struct parameter_sets sets;
    struct diffusion_setting *setting; /* per configuration */
    struct camera *camera;             /* per configuration */
};

static void release(void *state)
{
    struct diffusion_state *s = state;
    parameter_sets_release(&s->sets);
    free(s->setting);
    free(s->camera);
    free(s);
}

static status check(const struct radiance_input *in, struct error *err)
{
    const struct diffusion_option *o = in->diffusion;
    if (in->want_derivative)
        return error_set(err, STATUS_INVALID, "cannot render by diffusion with derivatives: it has none");
    if (in->discrepancy != NULL)
        return error_set(err, STATUS_INVALID, "cannot render by diffusion with a discrepancy: it has none");
    if (scattering_frame_reason(in->model->surface) != NULL)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s' by diffusion: %s", in->model->id,
                               scattering_frame_reason(in->model->surface));
    double tile_mm[2];
    scene_tile_mm(in->scene.fibers, tile_mm);
    if (o->tables->n_set != (in->n_set > 1 ? in->n_set : 1) || o->tables->tile_mm[0] != tile_mm[0] ||
        o->tables->tile_mm[1] != tile_mm[1])
        return error_set(err, STATUS_INVALID, "cannot render by diffusion: its tables are of another cloth");
    if (o->tables->black_sheet != scene_has_black_sheet(in->scene.fibers))
        return error_set(err, STATUS_INVALID,
                         "cannot render by diffusion: its tables are of the cloth %s a black sheet",
                         o->tables->black_sheet ? "with" : "without");
    return STATUS_OK;
}

static status prepare(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err)
{
    status st = check(in, err);
    if (st != STATUS_OK) return st;
    struct diffusion_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot use diffusion: out of memory");
    s->setting = calloc(n_configuration + 1, sizeof *s->setting);
    s->camera = calloc(n_configuration + 1, sizeof *s->camera);
    st = s->setting != NULL && s->camera != NULL
             ? parameter_sets_init(&s->sets, in->scene.fibers, in->model->surface, in->param, in->n_set, err)
             : error_set(err, STATUS_NO_MEMORY, "cannot use diffusion: out of memory");
    for (size_t i = 0; i < n_configuration && st == STATUS_OK; i++) {
        path_setting_init_sets(&s->setting[i].path, in->scene.fibers, &s->sets, &c[i], false);
        if (in->plain_paths) s->setting[i].path.guided_paths = false;
        diffusion_setting_init(&s->setting[i], in->diffusion);
        camera_init(&s->camera[i], &c[i]);
    }
    if (st == STATUS_OK)
        *state = s;
    else
        release(s);
    return st;
}

static uint64_t trace(const void *state, const struct radiance_block *b, float *value)
{
    const struct diffusion_state *s = state;
    const struct diffusion_setting *setting = &s->setting[b->member[0]];
    const struct camera *camera = &s->camera[b->member[0]];
    uint64_t n_bounce = 0;
    for (size_t i = 0; i < b->n_path; i++) {
        struct scene_ray ray;
        double xy[2];
        if (progress_cancelled(b->progress)) break;
        camera_blur(camera, b->xy[i], &b->rng[i], xy);
        if (!camera_ray(camera, setting->path.scene, xy, &ray)) continue;
        n_bounce += diffusion_shade(setting, &ray, &b->rng[i], value + 3 * i);
    }
    return n_bounce;
}

const struct radiance_tracer diffusion_radiance = {.max_member = 1,
                                                   .entry_bytes = 1,
                                                   .prepare = prepare,
                                                   .release = release,
                                                   .trace = trace,
                                                   .record = radiance_record_nothing,
                                                   .replay = radiance_replay_nothing};
