#include "renderer/preview/table_walks.h"

#include <math.h>
#include <string.h>

/* apart from estimates and pictures (render.c) */
enum { TABLE_REPLICA = 14 };

status table_walks_init(struct table_walks *w, const struct radiance_input *in, uint64_t seed, struct error *err)
{
    memset(w, 0, sizeof *w);
    if (in->model->kind != MODEL_SURFACE || in->scene.fibers == NULL)
        return error_set(err, STATUS_INVALID, "cannot make tables of the model '%s': it sees no fibers", in->model->id);
    const struct configuration none = {.light = LIGHT_NO_LAMP, .camera_distance_m = 1.0, .crop_m = 0.01};
    w->scene = in->scene.fibers;
    w->seed = seed;
    w->n_side = scene_has_black_sheet(w->scene) ? 1 : 2;
    w->thickness_mm = scene_thickness_mm(w->scene);
    scene_tile_mm(w->scene, w->tile_mm);
    status s = parameter_sets_init(&w->sets, w->scene, in->model->surface, in->param, in->n_set, err);
    if (s != STATUS_OK) return s;
    path_setting_init_sets(&w->setting, w->scene, &w->sets, &none, false);
    w->setting.discrepancy = in->discrepancy;
    w->setting.guided_paths = false; /* one for each of so many lights would cost more than it gains */
    return STATUS_OK;
}

void table_walks_release(struct table_walks *w) { parameter_sets_release(&w->sets); }

void table_walks_random(const struct table_walks *w, uint32_t purpose, uint32_t task, uint32_t i, struct rng *rng)
{
    rng_start(rng, &(struct rng_key){w->seed, purpose, TABLE_REPLICA, task & 4095u}, i, task >> 12);
}

void table_walks_place(const struct table_walks *w, const double start[2], uint32_t i, double at_mm[2])
{
    static const double step[2] = {0.75487766624669276, 0.56984029099805327};
    for (int a = 0; a < 2; a++) {
        double x = start[a] + step[a] * i;
        at_mm[a] = (x - floor(x)) * w->tile_mm[a];
    }
}

static void light_from(const double d[3], struct lamp *lamp)
{
    const struct configuration c = {.light = LIGHT_DIRECTIONAL,
                                    .light_theta_rad = acos(fmin(fmax(d[2], -1.0), 1.0)),
                                    .light_phi_rad = atan2(d[1], d[0])};
    lamp_init(lamp, &c);
}

void table_walks_trace(const struct table_walks *w, const double at_mm[2], const double wo[3], double (*wi)[3],
                       size_t n_light, struct rng *rng, float (*rgb)[3])
{
    struct lamp lamp[TABLE_LIGHTS];
    struct path_result path[TABLE_LIGHTS];
    struct scene_ray ray;
    double origin[3], towards[3], away = (wo[2] > 0.0 ? 1.0 : 1.0 + w->thickness_mm) / fabs(wo[2]);
    for (int a = 0; a < 3; a++) {
        origin[a] = (a < 2 ? at_mm[a] : 0.0) + away * wo[a];
        towards[a] = -wo[a];
    }
    memset(rgb, 0, n_light * sizeof *rgb);
    if (!scene_ray_enter(w->scene, origin, towards, &ray)) return;
    for (size_t k = 0; k < n_light; k++) light_from(wi[k], &lamp[k]);
    path_trace_lamps(&w->setting, lamp, n_light, &ray, rng, path);
    for (size_t k = 0; k < n_light; k++) memcpy(rgb[k], path[k].radiance, sizeof rgb[k]);
}
