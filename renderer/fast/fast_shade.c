#include "renderer/fast/fast_shade.h"
#include "renderer/fast/deep_shade.h"
#include "renderer/fast/gaussian_light.h"
#include "renderer/fast/sphere_harmonics.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/scene/scene_place.h"
#include "renderer/transport/surface/path_beyond.h"

#include <stdlib.h>
#include <string.h>

enum { GAUSSIAN_DIRECTIONS = 1024 }; /* of a Gaussian lamp over a flat cloth */

/* The hit of a camera ray. */
struct seen_hit {
    struct scene_hit hit;
    struct scene_place place;
    double offset_mm[2];
    float position_mm[3]; /* true place in the scene */
    struct fiber_frame frame;
    float wo[3], wo_scene[3];
    const struct scattering_state *state;
    size_t i_set;
};

static float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void describe(const struct fast_setting *s, const struct scene_ray *ray, struct seen_hit *h)
{
    memcpy(h->offset_mm, ray->offset_mm, sizeof h->offset_mm);
    for (int a = 0; a < 3; a++) {
        h->position_mm[a] = (float)((double)h->hit.position_mm[a] + (a < 2 ? h->offset_mm[a] : 0.0));
        h->wo_scene[a] = -ray->direction[a];
    }
    scene_place_find(s->path.scene, &h->hit, h->offset_mm, &h->place);
    fiber_frame_from(&h->frame, h->hit.tangent);
    fiber_frame_to_local(&h->frame, h->wo_scene, h->wo);
    h->i_set = scene_set_of(s->path.scene, h->hit.i_segment, s->path.n_set);
    h->state = s->path.state[h->i_set];
}

/* ---- light that is scattered once, by tables alone ---- */

/* Whether light from a direction reaches the hit, as the tables have it. */
static bool reaches(const struct fast_setting *s, const struct seen_hit *h, const float direction[3])
{
    const struct scene *scene = s->path.scene;
    if (scene_sheet_hides(scene, direction)) return false;
    static const float no_shift[2] = {0, 0};
    const struct fast_tables *t = s->option->tables;
    uint32_t row = t->segment_row[h->hit.i_segment];
    float d[3];
    if (row == FAST_NO_ROW) return false;
    scene_place_to_cloth(&h->place, direction, d);
    return fast_tables_distance(t, row, d) > 0 && !scene_shell_shades(scene, &h->hit, &h->place, no_shift, direction);
}

static void add_lamp(const struct fast_setting *s, const struct seen_hit *h, struct rng *rng, float radiance[3])
{
    const struct lamp *lamp = &s->path.lights.lamp;
    float u[2], direction[3], pdf, wi[3], rgb[3];
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    if (!lamp_sample(lamp, h->position_mm, u, direction, &pdf)) return;
    fiber_frame_to_local(&h->frame, direction, wi);
    s->path.model->eval(h->state, wi, h->wo, rgb, NULL);
    float light = lamp_radiance(lamp, direction) * fiber_frame_cos_theta(wi) / pdf;
    if (!((rgb[0] + rgb[1] + rgb[2]) * light > 0)) return;
    if (!reaches(s, h, direction)) return;
    for (int c = 0; c < 3; c++) radiance[c] += rgb[c] * light;
}

/* A Gaussian lamp in closed form; the shell of a bent cloth stands before it or not in one of its directions. */
static void add_gaussian_lamp(const struct fast_setting *s, const struct seen_hit *h, struct rng *rng,
                              float radiance[3])
{
    static const float no_shift[2] = {0, 0};
    const struct lamp *lamp = &s->path.lights.lamp;
    struct gaussian_fiber f = {.model = s->path.model, .state = h->state, .i_segment = h->hit.i_segment};
    float u[2], direction[3], pdf, axis[3], rgb[3];
    const float middle[3] = {-lamp->normal[0], -lamp->normal[1], -lamp->normal[2]};
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    if (!lamp_sample(lamp, h->position_mm, u, direction, &pdf) ||
        scene_shell_shades(s->path.scene, &h->hit, &h->place, no_shift, direction))
        return;
    scene_place_to_cloth(&h->place, h->hit.tangent, f.tangent);
    scene_place_to_cloth(&h->place, h->wo_scene, f.wo);
    scene_place_to_cloth(&h->place, middle, axis);
    gaussian_light_scatter(s->option->tables, &f, axis, lamp->sharpness, rgb);
    for (int c = 0; c < 3; c++) radiance[c] += lamp->radiance * rgb[c];
}

/* One direction of the image, and one that the fiber scatters from, combined by the power heuristic. */
static void add_environment(const struct fast_setting *s, const struct seen_hit *h, struct rng *rng, float radiance[3])
{
    static const float equal[3] = {1, 1, 1};
    const struct scattering_model *m = s->path.model;
    float u[3], direction[3], wi[3], rgb[3], light[3] = {0}, pdf_image;
    for (int a = 0; a < 3; a++) u[a] = rng_float(rng);
    m->sample(h->state, h->wo, equal, u, wi);
    float pdf = m->eval_pdf(h->state, wi, h->wo, equal, rgb, NULL);
    fiber_frame_to_world(&h->frame, wi, direction);
    if (pdf > 0 && reaches(s, h, direction)) {
        lights_add_environment(&s->path.lights, direction, pdf, light);
        for (int c = 0; c < 3; c++) radiance[c] += rgb[c] * light[c] * fiber_frame_cos_theta(wi) / pdf;
    }
    if (s->path.lights.image == NULL) return;
    u[0] = rng_float(rng);
    u[1] = rng_float(rng);
    if (!lights_sample_image(&s->path.lights, u, direction, light, &pdf_image)) return;
    fiber_frame_to_local(&h->frame, direction, wi);
    pdf = m->eval_pdf(h->state, wi, h->wo, equal, rgb, NULL);
    float weight = fiber_frame_cos_theta(wi) / pdf_image * lights_power_heuristic(pdf_image, pdf);
    if (!((rgb[0] + rgb[1] + rgb[2]) * weight > 0) || !reaches(s, h, direction)) return;
    for (int c = 0; c < 3; c++) radiance[c] += rgb[c] * light[c] * weight;
}

/* ---- light that is scattered more often ---- */

/* Irradiance of a surface that faces the lamp, and the direction to it; of a Gaussian lamp its light, and one of its
 * directions, chosen by u. */
static float lamp_irradiance(const struct lamp *lamp, const float position_mm[3], const float u[2], float direction[3])
{
    if (lamp->sharpness > 0) {
        float unused;
        lamp_sample(lamp, position_mm, u, direction, &unused);
        return lamp_gaussian_light(lamp);
    }
    if (lamp->directional) {
        for (int a = 0; a < 3; a++) direction[a] = -lamp->normal[a];
        return (float)M_PI;
    }
    float to[3];
    for (int a = 0; a < 3; a++) to[a] = lamp->centre_mm[a] - position_mm[a];
    float r2 = dot(to, to), r = sqrtf(r2), cosine = -dot(to, lamp->normal) / r;
    for (int a = 0; a < 3; a++) direction[a] = to[a] / r;
    return cosine > 0 ? lamp->radiance * 4 * lamp->half_side_mm * lamp->half_side_mm * cosine / r2 : 0;
}

/* Adds rgb times the harmonics of a direction in the flat cloth; zonal NULL: of a point. */
static void add_direction(const struct fast_tables *t, const float d[3], const float rgb[3], const float *zonal,
                          float *coefficient)
{
    size_t n = fast_n_harmonic(t), k = 0;
    float y[SPHERE_MAX_COUNT];
    if (t->mirrored != 0 && d[2] <= 0) return;
    sphere_harmonics(t->order, d, y);
    for (size_t l = 0; l <= t->order && zonal != NULL; l++)
        for (size_t m = 0; m < 2 * l + 1; m++) y[k++] *= zonal[l];
    for (size_t c = 0; c < 3; c++)
        for (k = 0; k < n; k++) coefficient[c * n + k] += rgb[c] * y[k];
}

/* The same for n directions of the lamp. u: chooses one of n = 1 of a Gaussian lamp. */
static void add_lamp_directions(const struct fast_setting *s, const struct scene_place *place,
                                const float position_mm[3], const float u[2], size_t n, float *coefficient)
{
    for (size_t i = 0; i < n; i++) {
        float direction[3], d[3], even[2] = {((float)i + 0.5f) / (float)n, fmodf(0.61803399f * (float)i, 1)};
        float e = lamp_irradiance(&s->path.lights.lamp, position_mm, n > 1 ? even : u, direction) / (float)n;
        const float rgb[3] = {e, e, e};
        scene_place_to_cloth(place, direction, d);
        add_direction(s->option->tables, d, rgb, NULL, coefficient);
    }
}

/* Coefficients of all light from outside in the flat cloth at a place; 3 x n_harmonic. u NULL: many directions of a
 * Gaussian lamp, otherwise one of them. */
static void light_coefficients(const struct fast_setting *s, const struct scene_place *place,
                               const float position_mm[3], const float u[2], float *coefficient)
{
    const struct fast_tables *t = s->option->tables;
    float d[3];
    bool gaussian = s->path.lights.lamp.sharpness > 0;
    memset(coefficient, 0, 3 * fast_n_harmonic(t) * sizeof *coefficient);
    if (s->path.lights.has_lamp)
        add_lamp_directions(s, place, position_mm, u, gaussian && u == NULL ? GAUSSIAN_DIRECTIONS : 1, coefficient);
    for (size_t i = 0; i < s->mixture.n; i++) {
        scene_place_to_cloth(place, s->mixture.direction[i], d);
        add_direction(t, d, s->mixture.rgb[i], s->mixture.zonal, coefficient);
    }
}

static void apply_transfer(const struct fast_tables *t, uint32_t row, const float *light, float *arriving)
{
    size_t n = fast_n_harmonic(t);
    const float *a = t->transfer + (size_t)row * 3 * n * n;
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < n; i++) {
            float sum = 0;
            for (size_t k = 0; k < n; k++) sum += a[(c * n + i) * n + k] * light[c * n + k];
            arriving[c * n + i] = sum;
        }
}

/* The frame in which the fiber's table is: z along the fiber, w_o in the x-z plane. Rows in the flat cloth. */
static float table_frame(const struct seen_hit *h, float row[3][3])
{
    float wo[3];
    scene_place_to_cloth(&h->place, h->hit.tangent, row[2]);
    scene_place_to_cloth(&h->place, h->wo_scene, wo);
    float along = dot(wo, row[2]);
    for (int a = 0; a < 3; a++) row[0][a] = wo[a] - along * row[2][a];
    float length2 = dot(row[0], row[0]);
    if (length2 > 1e-10f) {
        float inv = 1 / sqrtf(length2);
        for (int a = 0; a < 3; a++) row[0][a] *= inv;
    } else {
        struct fiber_frame f;
        fiber_frame_from(&f, row[2]);
        memcpy(row[0], f.v, sizeof f.v);
    }
    for (int a = 0; a < 3; a++)
        row[1][a] = row[2][(a + 1) % 3] * row[0][(a + 2) % 3] - row[2][(a + 2) % 3] * row[0][(a + 1) % 3];
    return asinf(fminf(fmaxf(along, -1), 1));
}

/* Whether the shell of a bent cloth lets light from a direction through, to a place beside the hit where it may have
 * entered. */
static bool shell_is_open(const struct fast_setting *s, const struct seen_hit *h, const float direction[3],
                          struct rng *rng)
{
    if (!scene_is_bent(s->path.scene)) return true;
    float shift[2];
    double normal[2];
    rng_normal_pair(rng, normal);
    for (int a = 0; a < 2; a++) shift[a] = (float)(normal[a] * s->option->tables->spread_mm);
    return !scene_shell_shades(s->path.scene, &h->hit, &h->place, shift, direction);
}

/* The same for all light from outside, by one direction that is chosen. */
static bool shell_lets_through(const struct fast_setting *s, const struct seen_hit *h, const float u[2],
                               struct rng *rng)
{
    if (!scene_is_bent(s->path.scene)) return true;
    float direction[3];
    float lamp = s->path.lights.has_lamp ? lamp_irradiance(&s->path.lights.lamp, h->position_mm, u, direction) : 0;
    if (s->mixture.n > 0) {
        size_t k = light_mixture_pick(&s->mixture, rng_float(rng));
        float sky = 0;
        for (size_t i = 0; i < s->mixture.n; i++) sky += s->mixture.rgb[i][1];
        if (rng_float(rng) * (lamp + sky) >= lamp) memcpy(direction, s->mixture.direction[k], sizeof direction);
    }
    return shell_is_open(s, h, direction, rng);
}

static void add_transfer(const struct fast_setting *s, const struct seen_hit *h, struct rng *rng, float radiance[3])
{
    const struct fast_tables *t = s->option->tables;
    size_t n = fast_n_harmonic(t);
    uint32_t cell = fast_tables_cell_at(t, h->place.position_mm);
    float scale = 1, computed[3 * SPHERE_MAX_COUNT], turned[3 * SPHERE_MAX_COUNT], rotation[SPHERE_MAX_ROTATION];
    float u[2] = {0.5f, 0.5f}; /* chooses a direction of a Gaussian lamp */
    const float *arriving = computed;
    for (int k = 0; k < 2 && s->arriving == NULL && s->path.lights.lamp.sharpness > 0; k++) u[k] = rng_float(rng);
    if (cell == FAST_NO_ROW || !shell_lets_through(s, h, u, rng)) return;
    if (s->arriving != NULL) {
        float unused[3], centre[3] = {0, 0, 0};
        const struct lamp *lamp = &s->path.lights.lamp;
        arriving = s->arriving + (size_t)cell * 3 * n;
        if (s->path.lights.has_lamp && s->mixture.n == 0)
            scale = lamp_irradiance(lamp, h->position_mm, u, unused) / lamp_irradiance(lamp, centre, u, unused);
    } else {
        float light[3 * SPHERE_MAX_COUNT];
        light_coefficients(s, &h->place, h->position_mm, u, light);
        apply_transfer(t, cell, light, computed);
    }
    float row[3][3], theta = table_frame(h, row);
    sphere_rotation(t->order, (const float(*)[3])row, rotation);
    sphere_rotate(t->order, rotation, arriving, 3, turned);
    size_t i = (size_t)lrintf((theta * (float)M_1_PI + 0.5f) * (FAST_N_THETA - 1));
    const float *scatter = t->scatter + (h->i_set * FAST_N_THETA + i) * 3 * n;
    for (size_t c = 0; c < 3; c++) {
        float sum = 0;
        for (size_t k = 0; k < n; k++) sum += scatter[c * n + k] * turned[c * n + k];
        radiance[c] += scale * sum; /* not cut at 0: the mean over fibers would be too bright */
    }
}

/* ---- a whole ray ---- */

/* Light that is scattered once as the tables have it. */
static uint32_t shade_by_tables(const struct fast_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3])
{
    struct seen_hit h;
    if (!scene_trace(s->path.scene, ray, &h.hit)) {
        path_add_beyond(&s->path, ray, radiance);
        return 0;
    }
    describe(s, ray, &h);
    const struct lamp *lamp = &s->path.lights.lamp;
    bool closed = s->path.lights.has_lamp && lamp->sharpness > 0 && s->path.model->gaussian != NULL;
    if (closed) add_gaussian_lamp(s, &h, rng, radiance);
    if (s->path.lights.has_lamp && !closed) add_lamp(s, &h, rng, radiance);
    if (s->mixture.n > 0) add_environment(s, &h, rng, radiance);
    add_transfer(s, &h, rng, radiance);
    return 1;
}

/* path_setting.finish */
static void finish(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                   float rgb[3])
{
    const struct fast_setting *s = context;
    struct seen_hit h = {.hit = *hit};
    describe(s, ray, &h);
    add_transfer(s, &h, rng, rgb);
}

uint32_t fast_shade(const struct fast_setting *s, struct scene_ray *ray, struct rng *rng, float radiance[3])
{
    if (s->option->visibility == FAST_TABLES) return shade_by_tables(s, ray, rng, radiance);
    struct path_result path;
    path_trace(&s->path, ray, rng, &path, NULL);
    for (int c = 0; c < 3; c++) radiance[c] += path.radiance[c];
    return path.n_bounce;
}

/* ---- values that all rays share ---- */

static status fill_arriving(struct fast_setting *s, struct error *err)
{
    const struct fast_tables *t = s->option->tables;
    const struct scene_place flat = {.to_cloth = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    static const float centre[3] = {0, 0, 0};
    float light[3 * SPHERE_MAX_COUNT];
    size_t n = 3 * fast_n_harmonic(t);
    s->arriving = malloc((t->n_transfer * n + 1) * sizeof *s->arriving);
    if (s->arriving == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot use tables: out of memory");
    light_coefficients(s, &flat, centre, NULL, light);
    for (uint32_t i = 0; i < t->n_transfer; i++) apply_transfer(t, i, light, s->arriving + i * n);
    return STATUS_OK;
}

status fast_setting_init(struct fast_setting *s, const struct fast_option *option, struct error *err)
{
    s->option = option;
    s->arriving = NULL;
    s->path.n_traced = option->n_traced > 0 ? option->n_traced : 1;
    s->path.finish = option->deep ? NULL : finish;
    s->path.begin = option->deep ? deep_shade_begin : NULL;
    s->path.finish_context = s;
    if (s->path.n_traced == 1) s->path.guided_paths = false;
    light_mixture_init(&s->mixture, &s->path.lights);
    return option->deep || scene_is_bent(s->path.scene) ? STATUS_OK : fill_arriving(s, err);
}

void fast_setting_release(struct fast_setting *s) { free(s->arriving); }
