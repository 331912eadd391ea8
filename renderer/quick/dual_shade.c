#include "renderer/quick/dual_shade.h"
#include "renderer/scattering/fiber_direction.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/transport/surface/path_beyond.h"

#include <string.h>

/* Light that passes less than this share of fibers counts as none. */
static const float least_transmitted = 1e-3f;

/* ---- fibers in front ---- */

struct count {
    const struct dual_setting *s;
    struct dual_front *front;
};

static bool pass_fiber(void *context, uint32_t i_segment, float sin_theta)
{
    struct count *c = context;
    const struct path_setting *path = &c->s->path;
    struct dual_average a;
    size_t i_set = scene_set_of(path->scene, i_segment, path->n_set);
    float cos_theta = sqrtf(fmaxf(0, 1 - sin_theta * sin_theta)), most = 0;
    dual_average_at(c->s->option->tables, i_set, fiber_angle(sin_theta, cos_theta), &a);
    for (int k = 0; k < 3; k++) {
        c->front->transmitted[k] *= a.forward[k];
        most = fmaxf(most, c->front->transmitted[k]);
    }
    c->front->var_rad2 += a.var_forward_rad2;
    c->front->n_fiber++;
    return most >= least_transmitted;
}

bool dual_front_of(const struct dual_setting *s, const struct dual_hit *h, const float direction[3], struct rng *rng,
                   struct dual_front *front)
{
    struct scene_ray ray;
    *front = (struct dual_front){.transmitted = {1, 1, 1}};
    struct count c = {s, front};
    if (scene_sheet_hides(s->path.scene, direction)) return false;
    if (s->path.model->across_width)
        scene_ray_leave_across(&h->hit, h->offset_mm, direction, rng_float(rng), &ray);
    else
        scene_ray_leave(&h->hit, h->offset_mm, direction, &ray);
    return scene_visit_ahead(s->path.scene, &ray, pass_fiber, &c);
}

/* ---- what the hit makes of the light ---- */

void dual_scattering(const struct dual_setting *s, const struct dual_hit *h, const float wi[3],
                     const struct dual_front *front, float s_rgb[3])
{
    const struct dual_tables *t = s->option->tables;
    struct fiber_direction i = fiber_direction_of(wi), o = fiber_direction_of(h->wo);
    float cos_phi = i.azimuth[0] * o.azimuth[0] + i.azimuth[1] * o.azimuth[1], deep[3];
    float phi = acosf(fminf(fmaxf(cos_phi, -1), 1));
    struct dual_average a;
    dual_average_at(t, h->i_set, i.theta_rad, &a);
    dual_deep_lobe(t, &a, i.theta_rad, o.theta_rad, front->var_rad2, deep);
    if (front->n_fiber == 0) {
        s->path.model->eval(s->path.state[h->i_set], wi, h->wo, s_rgb, NULL);
        for (int c = 0; c < 3 && cos_phi >= 0; c++) s_rgb[c] += s->option->density_backward * deep[c];
        return;
    }
    /* light from all azimuths of half a turn: the share 1 - phi / pi of them is on the eye's side */
    float same_side = 1 - phi * (float)M_1_PI;
    dual_blurred_at(t, h->i_set, i.theta_rad, o.theta_rad, phi, front->var_rad2, s_rgb);
    for (int c = 0; c < 3; c++) {
        s_rgb[c] += s->option->density_backward * same_side * deep[c];
        s_rgb[c] *= s->option->density_forward * front->transmitted[c];
    }
}

/* Adds light from a direction, already divided by the density that chose it. */
static void add_light(const struct dual_setting *s, const struct dual_hit *h, const float direction[3],
                      const float light[3], struct rng *rng, float radiance[3])
{
    struct dual_front front = {.n_fiber = 0};
    float wi[3], s_rgb[3];
    if (!(light[0] + light[1] + light[2] > 0) || !dual_front_of(s, h, direction, rng, &front)) return;
    fiber_frame_to_local(&h->frame, direction, wi);
    dual_scattering(s, h, wi, &front, s_rgb);
    for (int c = 0; c < 3; c++) radiance[c] += s_rgb[c] * light[c] * fiber_frame_cos_theta(wi);
}

static void add_lamp(const struct dual_setting *s, const struct dual_hit *h, struct rng *rng, float radiance[3])
{
    const struct lamp *lamp = &s->path.lights.lamp;
    float u[2], direction[3], position[3], pdf;
    for (int a = 0; a < 3; a++) position[a] = (float)((double)h->hit.position_mm[a] + (a < 2 ? h->offset_mm[a] : 0.0));
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    if (!lamp_sample(lamp, position, u, direction, &pdf)) return;
    const float light = lamp_radiance(lamp, direction) / pdf, rgb[3] = {light, light, light};
    add_light(s, h, direction, rgb, rng, radiance);
}

/* Adds light of the environments from a direction that one of three densities has chosen: that of the image, of the
 * fiber's scattering, and a uniform one. Divided by the sum of them (balance heuristic). */
static void add_from(const struct dual_setting *s, const struct dual_hit *h, const float direction[3], struct rng *rng,
                     float radiance[3])
{
    const struct lights *l = &s->path.lights;
    float wi[3], light[3] = {0, 0, 0}, pdf = (float)(0.25 * M_1_PI);
    fiber_frame_to_local(&h->frame, direction, wi);
    pdf += s->path.model->pdf(s->path.state[h->i_set], wi, h->wo, NULL);
    lights_add_environment(l, direction, 0, light);
    if (l->image != NULL) {
        float world[3], unused[3];
        lights_turn(l->image_turn, 1, direction, world);
        pdf += environment_at(l->image, world, unused);
    }
    for (int c = 0; c < 3; c++) light[c] /= pdf;
    add_light(s, h, direction, light, rng, radiance);
}

static void add_environment(const struct dual_setting *s, const struct dual_hit *h, struct rng *rng, float radiance[3])
{
    float u[3], wi[3], direction[3], unused[3], pdf;
    for (int a = 0; a < 3; a++) u[a] = rng_float(rng);
    s->path.model->sample(s->path.state[h->i_set], h->wo, NULL, u, wi);
    fiber_frame_to_world(&h->frame, wi, direction);
    add_from(s, h, direction, rng, radiance);
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    direction[2] = 1 - 2 * u[0];
    float level = sqrtf(fmaxf(0, 1 - direction[2] * direction[2]));
    direction[0] = level * cosf((float)(2 * M_PI) * u[1]);
    direction[1] = level * sinf((float)(2 * M_PI) * u[1]);
    add_from(s, h, direction, rng, radiance);
    if (s->path.lights.image == NULL) return;
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    if (lights_sample_image(&s->path.lights, u, direction, unused, &pdf)) add_from(s, h, direction, rng, radiance);
}

uint32_t dual_shade(const struct dual_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3])
{
    const struct lights *l = &s->path.lights;
    struct dual_hit h;
    if (!scene_trace(s->path.scene, ray, &h.hit)) {
        path_add_beyond(&s->path, ray, radiance);
        return 0;
    }
    const float back[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]};
    memcpy(h.offset_mm, ray->offset_mm, sizeof h.offset_mm);
    fiber_frame_from(&h.frame, h.hit.tangent);
    fiber_frame_to_local(&h.frame, back, h.wo);
    h.i_set = scene_set_of(s->path.scene, h.hit.i_segment, s->path.n_set);
    if (l->has_lamp) add_lamp(s, &h, rng, radiance);
    if (l->has_constant || l->image != NULL) add_environment(s, &h, rng, radiance);
    return 1;
}
