#include "renderer/fast/fast_radiance.h"
#include "renderer/fast/fast_shade.h"
#include "renderer/scene/scene_place.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/radiance_unrecorded.h"

#include <stdlib.h>
#include <string.h>

struct fast_state {
    struct parameter_sets sets;
    size_t n_configuration;
    struct fast_setting *setting; /* per configuration */
    struct camera *camera;        /* per configuration */
};

static void release(void *state)
{
    struct fast_state *s = state;
    for (size_t i = 0; i < s->n_configuration && s->setting != NULL; i++) fast_setting_release(&s->setting[i]);
    parameter_sets_release(&s->sets);
    free(s->setting);
    free(s->camera);
    free(s);
}

static status check(const struct radiance_input *in, struct error *err)
{
    const struct fast_option *o = in->fast;
    double tile_mm[2];
    if (in->want_derivative)
        return error_set(err, STATUS_INVALID, "cannot render by tables with derivatives: tables have none");
    if (in->discrepancy != NULL)
        return error_set(err, STATUS_INVALID, "cannot render by tables with a discrepancy: tables have none");
    if (scattering_frame_reason(in->model->surface) != NULL)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s' by tables: %s", in->model->id,
                               scattering_frame_reason(in->model->surface));
    if (!(o->corrected_share >= 0.0 && o->corrected_share <= 1.0) ||
        (o->corrected_share > 0.0 && o->visibility != FAST_TRACED))
        return error_set(err, STATUS_INVALID, "cannot correct a share of %g of the samples", o->corrected_share);
    scene_tile_mm(in->scene.fibers, tile_mm);
    size_t n_set = in->n_set > 1 ? in->n_set : 1;
    if (o->tables->n_set != n_set || o->tables->tile_mm[0] != tile_mm[0] || o->tables->tile_mm[1] != tile_mm[1])
        return error_set(err, STATUS_INVALID, "cannot render by tables of another cloth");
    if (o->visibility == FAST_TABLES &&
        (o->tables->n_row == 0 || o->tables->n_segment != scene_n_segment(in->scene.fibers)))
        return error_set(err, STATUS_INVALID, "cannot render by tables: they do not have what the segments see");
    if (o->tables->mirrored != 0 && !scene_has_black_sheet(in->scene.fibers))
        return error_set(err, STATUS_INVALID,
                         "cannot render a cloth without a black sheet by tables of one with a black sheet");
    return STATUS_OK;
}

static status prepare(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err)
{
    status st = check(in, err);
    if (st != STATUS_OK) return st;
    struct fast_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot use tables: out of memory");
    s->setting = calloc(n_configuration + 1, sizeof *s->setting);
    s->camera = calloc(n_configuration + 1, sizeof *s->camera);
    st = s->setting != NULL && s->camera != NULL
             ? parameter_sets_init(&s->sets, in->scene.fibers, in->model->surface, in->param, in->n_set, err)
             : error_set(err, STATUS_NO_MEMORY, "cannot use tables: out of memory");
    for (size_t i = 0; i < n_configuration && st == STATUS_OK; i++) {
        path_setting_init_sets(&s->setting[i].path, in->scene.fibers, &s->sets, &c[i], false);
        if (in->plain_paths) s->setting[i].path.guided_paths = false;
        camera_init(&s->camera[i], &c[i]);
        s->n_configuration = i + 1;
        st = fast_setting_init(&s->setting[i], in->fast, err);
    }
    if (st == STATUS_OK)
        *state = s;
    else
        release(s);
    return st;
}

static uint64_t trace(const void *state, const struct radiance_block *b, float *value)
{
    const struct fast_state *s = state;
    const struct fast_setting *setting = &s->setting[b->member[0]];
    const struct camera *camera = &s->camera[b->member[0]];
    uint64_t n_bounce = 0;
    for (size_t i = 0; i < b->n_path; i++) {
        struct scene_ray ray;
        double xy[2];
        if (progress_cancelled(b->progress)) break;
        camera_blur(camera, b->xy[i], &b->rng[i], xy);
        if (!camera_ray(camera, setting->path.scene, xy, &ray)) continue;
        n_bounce += fast_shade(setting, &ray, &b->rng[i], value + 3 * i);
    }
    return n_bounce;
}

const struct radiance_tracer fast_radiance = {.max_member = 1,
                                              .entry_bytes = 1,
                                              .prepare = prepare,
                                              .release = release,
                                              .trace = trace,
                                              .record = radiance_record_nothing,
                                              .replay = radiance_replay_nothing};
