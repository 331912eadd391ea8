#include "renderer/transport/surface/surface_radiance.h"
#include "renderer/scene/scene_glint.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/surface/path_order.h"
#include "renderer/transport/surface/path_tracer.h"

#include <stdlib.h>
#include <string.h>

struct surface_state {
    const struct scene *scene;
    struct parameter_sets sets;
    struct speckle_numbers numbers; /* only with speckle */
    size_t n_jac;
    struct path_setting *setting; /* per configuration */
    struct camera *camera;        /* per configuration */
};

static void release(void *state)
{
    struct surface_state *s = state;
    parameter_sets_release(&s->sets);
    free(s->setting);
    free(s->camera);
    free(s);
}

static status prepare(const struct radiance_input *in, const struct configuration *c, size_t n_configuration,
                      void **state, struct error *err)
{
    const struct scattering_model *m = in->model->surface;
    if (in->has_speckle && m->speckle == NULL)
        return error_set_field(err, STATUS_INVALID, "model", "cannot render model '%s' with speckle: it has none",
                               m->id);
    if (in->has_speckle && in->want_derivative)
        return error_set(err, STATUS_INVALID,
                         "cannot trace with speckle and derivatives: speckle is of pictures alone");
    if (in->n_hit > 0 && in->want_derivative)
        return error_set(err, STATUS_INVALID, "cannot end paths at a hit with derivatives: they are of pictures alone");
    struct surface_state *s = calloc(1, sizeof *s);
    if (s == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot trace fibers: out of memory");
    s->scene = in->scene.fibers;
    s->setting = malloc((n_configuration + 1) * sizeof *s->setting);
    s->camera = malloc((n_configuration + 1) * sizeof *s->camera);
    status st = s->setting != NULL && s->camera != NULL
                    ? parameter_sets_init(&s->sets, s->scene, m, in->param, in->n_set, err)
                    : error_set(err, STATUS_NO_MEMORY, "cannot trace fibers: out of memory");
    if (st == STATUS_OK && in->pixel_m > 0) st = scene_glints_make(s->scene, err);
    if (st != STATUS_OK) {
        release(s);
        return st;
    }
    if (in->has_speckle) speckle_numbers_init(&s->numbers);
    s->n_jac = in->want_derivative ? 3 * s->sets.n * m->n_param : 0;
    for (size_t i = 0; i < n_configuration; i++) {
        path_setting_init_sets(&s->setting[i], s->scene, &s->sets, &c[i], in->want_derivative);
        s->setting[i].n_traced = in->n_hit;
        if (in->n_hit == 1) s->setting[i].guided_paths = false;
        s->setting[i].pixel_um = path_setting_pixel_um(in->pixel_m);
        if (in->plain_paths) s->setting[i].guided_paths = s->setting[i].has_strips = false;
        s->setting[i].discrepancy = in->discrepancy;
        if (in->has_speckle) s->setting[i].speckle = (struct speckle){m->speckle, &s->numbers, in->speckle_seed};
        path_setting_choose(&s->setting[i]);
        camera_init(&s->camera[i], &c[i]);
    }
    *state = s;
    return STATUS_OK;
}

static uint64_t trace(const void *state, const struct radiance_block *b, float *value)
{
    const struct surface_state *s = state;
    const struct path_setting *setting = &s->setting[b->member[0]];
    const struct camera *camera = &s->camera[b->member[0]];
    size_t n_lamp = setting->lights.has_lamp ? b->n_member : 0, n_value = 3 + s->n_jac;
    uint64_t n_bounce = 0;
    struct lamp lamp[PATH_MAX_LAMP];
    struct path_result path[PATH_MAX_LAMP];
    uint32_t order[RADIANCE_MOST_PATHS];
    path_order_fill(camera, s->scene, b->n_path, b->xy, order);
    for (size_t k = 0; k < b->n_member; k++) lamp[k] = s->setting[b->member[k]].lights.lamp;
    for (size_t k = 0; k < b->n_path; k++) {
        const size_t i = order[k];
        struct scene_ray ray;
        struct camera pinhole;
        double xy[2];
        if (progress_cancelled(b->progress)) break; /* a block of white cloth takes longer than a caller will wait */
        camera_blur(camera, b->xy[i], &b->rng[i], xy);
        if (!camera_ray(camera_through_lens(camera, &b->rng[i], &pinhole, xy), s->scene, xy, &ray))
            continue; /* sees nothing: adds 0 */
        path_trace_lamps(setting, lamp, n_lamp, &ray, &b->rng[i], path);
        n_bounce += path[0].n_bounce;
        for (size_t m = 0; m < b->n_member; m++) {
            float *v = value + (i * b->n_member + m) * n_value;
            memcpy(v, path[m].radiance, sizeof path[m].radiance);
            memcpy(v + 3, path[m].jac, s->n_jac * sizeof *v);
        }
    }
    return n_bounce;
}

static void record_path(const void *state, size_t i_configuration, const double xy[2], struct rng *rng,
                        struct radiance_record *record, float *value)
{
    const struct surface_state *s = state;
    struct path_result path;
    struct scene_ray ray;
    struct path_record steps = {0, record->capacity, record->entry};
    struct camera pinhole;
    double at[2];
    record->n_entry = record->n_bounce = 0;
    camera_blur(&s->camera[i_configuration], xy, rng, at);
    if (!camera_ray(camera_through_lens(&s->camera[i_configuration], rng, &pinhole, at), s->scene, at, &ray)) return;
    path_trace(&s->setting[i_configuration], &ray, rng, &path, &steps);
    record->n_entry = record->n_bounce = steps.n_step;
    memcpy(value, path.radiance, sizeof path.radiance);
    memcpy(value + 3, path.jac, s->n_jac * sizeof *value);
}

static double replay(const void *at, const void *traced, const struct radiance_record *record)
{
    const struct surface_state *by = traced; /* its sampling is in the record */
    const struct parameter_sets *sets = &((const struct surface_state *)at)->sets;
    const struct path_record steps = {record->n_entry, record->capacity, record->entry};
    return path_replay(sets, &steps, by->setting[0].shows_width);
}

const struct radiance_tracer surface_radiance = {.max_path = RADIANCE_MOST_PATHS,
                                                 .max_member = PATH_MAX_LAMP,
                                                 .entry_bytes = sizeof(struct path_step),
                                                 .prepare = prepare,
                                                 .release = release,
                                                 .trace = trace,
                                                 .record = record_path,
                                                 .replay = replay};
