#include "renderer/quick/diffusion_shade.h"
#include "renderer/scene/scene_place.h"

#include <string.h>

/* The last traced hit of a path. */
struct last_hit {
    struct scene_hit hit;
    struct scene_place place;
    float position_mm[3]; /* true place in the scene */
    float wo[3];          /* towards the eye, in the flat cloth */
    float leaving[2][3];  /* fraction of the light of each side that goes towards the eye */
};

/* Whether the cloth, where it is bent, stands before light from a direction at a place around the hit: light enters at
 * a distance that is drawn from the dipole of one channel. weight: density of the distance in each channel over that
 * with which it was drawn. */
static bool enters_around(const struct diffusion_setting *s, const struct last_hit *h, size_t side,
                          const float direction[3], struct rng *rng, float weight[3])
{
    for (int c = 0; c < 3; c++) weight[c] = 1;
    if (!scene_is_bent(s->path.scene)) return true; /* the light over a flat cloth is the same some millimetres away */
    const struct diffuse_dipole *d = s->option->tables->dipole[side];
    uint32_t channel = rng_u32(rng) % 3;
    double u = rng_double(rng), r = diffuse_dipole_sample(&d[channel], u, rng_double(rng)), density[3], all = 0.0;
    float phi = (float)(2 * M_PI) * rng_float(rng), shift[2] = {(float)r * cosf(phi), (float)r * sinf(phi)};
    for (int c = 0; c < 3; c++) {
        density[c] = diffuse_dipole_at(&d[c], r) / diffuse_dipole_reflectance(&d[c]);
        all += density[c] / 3.0;
    }
    for (int c = 0; c < 3; c++) weight[c] = (float)(density[c] / all);
    return !scene_shell_shades(s->path.scene, &h->hit, &h->place, shift, direction);
}

/* Adds light from a direction, which is given divided by the density of that. */
static void add_light(const struct diffusion_setting *s, const struct last_hit *h, const float direction[3],
                      const float light[3], struct rng *rng, float rgb[3])
{
    float d[3], entering[3], weight[3];
    scene_place_to_cloth(&h->place, direction, d);
    size_t side = d[2] <= 0;
    const float *leaving = h->leaving[side];
    if (!(leaving[0] + leaving[1] + leaving[2] > 0 && light[0] + light[1] + light[2] > 0)) return;
    if (!enters_around(s, h, side, direction, rng, weight)) return;
    diffusion_entering_at(s->option->tables, h->wo, d, entering);
    for (int c = 0; c < 3; c++) rgb[c] += leaving[c] * entering[c] * weight[c] * light[c] * fabsf(d[2]) * (float)M_1_PI;
}

static void add_lamp(const struct diffusion_setting *s, const struct last_hit *h, struct rng *rng, float rgb[3])
{
    const struct lamp *lamp = &s->path.lights.lamp;
    float u[2], direction[3], pdf;
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    if (!lamp_sample(lamp, h->position_mm, u, direction, &pdf)) return;
    float light = lamp_radiance(lamp, direction) / pdf;
    add_light(s, h, direction, (const float[3]){light, light, light}, rng, rgb);
}

/* The direction in the scene that has the direction d in the flat cloth, nearly. */
static void from_cloth(const struct scene_place *p, const float d[3], float out[3])
{
    float length2 = 0;
    for (int a = 0; a < 3; a++) {
        out[a] = p->to_cloth[0][a] * d[0] + p->to_cloth[1][a] * d[1] + p->to_cloth[2][a] * d[2];
        length2 += out[a] * out[a];
    }
    for (int a = 0; a < 3; a++) out[a] /= sqrtf(length2);
}

/* Probability of a direction above the cloth among those drawn for the environment. */
static float share_above(const struct last_hit *h)
{
    float up = h->leaving[0][0] + h->leaving[0][1] + h->leaving[0][2],
          down = h->leaving[1][0] + h->leaving[1][1] + h->leaving[1][2];
    return up + down > 0 ? up / (up + down) : 1;
}

static float density_around(const struct last_hit *h, const float direction[3])
{
    float d[3], up = share_above(h);
    scene_place_to_cloth(&h->place, direction, d);
    return (d[2] > 0 ? up : 1 - up) * fabsf(d[2]) * (float)M_1_PI;
}

/* One direction by its cosine to the cloth, and one of the image, combined by the power heuristic. */
static void add_environment(const struct diffusion_setting *s, const struct last_hit *h, struct rng *rng, float rgb[3])
{
    const struct lights *l = &s->path.lights;
    float u[3], direction[3], light[3] = {0, 0, 0}, pdf;
    for (int a = 0; a < 3; a++) u[a] = rng_float(rng);
    float r = sqrtf(u[0]), phi = (float)(2 * M_PI) * u[1], z = sqrtf(fmaxf(1 - u[0], 1e-12f));
    const float d[3] = {r * cosf(phi), r * sinf(phi), u[2] < share_above(h) ? z : -z};
    from_cloth(&h->place, d, direction);
    pdf = density_around(h, direction);
    if (pdf > 0) {
        lights_add_environment(l, direction, pdf, light);
        for (int c = 0; c < 3; c++) light[c] /= pdf;
        add_light(s, h, direction, light, rng, rgb);
    }
    if (l->image == NULL) return;
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    if (!lights_sample_image(l, u, direction, light, &pdf)) return;
    float weight = lights_power_heuristic(pdf, density_around(h, direction)) / pdf;
    for (int c = 0; c < 3; c++) light[c] *= weight;
    add_light(s, h, direction, light, rng, rgb);
}

/* path_setting.finish */
static void finish(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                   float rgb[3])
{
    const struct diffusion_setting *s = context;
    const float back[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]};
    struct last_hit h = {.hit = *hit};
    for (int a = 0; a < 3; a++)
        h.position_mm[a] = (float)((double)hit->position_mm[a] + (a < 2 ? ray->offset_mm[a] : 0.0));
    scene_place_find(s->path.scene, hit, ray->offset_mm, &h.place);
    scene_place_to_cloth(&h.place, back, h.wo);
    for (size_t side = 0; side < 2; side++) diffusion_leaving_at(s->option->tables, side, h.wo, h.leaving[side]);
    if (s->path.lights.has_lamp) add_lamp(s, &h, rng, rgb);
    if (s->path.lights.has_constant || s->path.lights.image != NULL) add_environment(s, &h, rng, rgb);
}

void diffusion_setting_init(struct diffusion_setting *s, const struct diffusion_option *option)
{
    s->option = option;
    s->path.n_traced = option->tables->n_traced;
    s->path.finish = finish;
    s->path.finish_context = s;
    if (s->path.n_traced == 1) s->path.guided_paths = false;
}

uint32_t diffusion_shade(const struct diffusion_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3])
{
    struct path_result path;
    path_trace(&s->path, ray, rng, &path, NULL);
    for (int c = 0; c < 3; c++) radiance[c] += path.radiance[c];
    return path.n_bounce;
}
