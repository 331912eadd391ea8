/* Connections of a bounce with the lights, and how light is added to a path. Only path_steps.h includes this header. */
#ifndef SELVEDGE_RENDERER_PATH_CONNECT_H
#define SELVEDGE_RENDERER_PATH_CONNECT_H

#include "renderer/transport/path_value.h"
#include "renderer/transport/surface/fiber_walk.h"
#include "renderer/transport/surface/path_factor.h"
#include "renderer/transport/surface/path_scatter.h"
#include "renderer/transport/surface/path_walk.h"

#include <string.h>

/* Adds value to the radiance and value * (H + score) to the derivatives. score NULL: the scores of the last step are
 * part of H already. */
static inline void path_add_light(struct walk *w, const float value[3], const float *score)
{
    for (int c = 0; c < 3; c++) w->out->radiance[c] += value[c];
    if (!w->s->want_jacobian) return;
    const size_t n = w->s->model->n_param, n_set = PATH_PLAIN ? 1 : w->s->n_set;
    const float *h = w->h;
    float *jac = w->out->jac;
    for (size_t c = 0; c < 3; c++)
        for (size_t k = 0; k < n_set; k++, h += n, jac += n)
            if (score != NULL && (PATH_PLAIN || k == w->i_set))
                for (size_t p = 0; p < n; p++) jac[p] += value[c] * (h[p] + score[c * n + p]);
            else
                for (size_t p = 0; p < n; p++) jac[p] += value[c] * h[p];
}

static inline void path_add_light_to_all(struct walk *w, const float value[3], const float *score)
{
    for (size_t i = 0; i < w->n_out; i++) {
        w->out = w->first_out + i;
        path_add_light(w, value, score);
    }
}

static inline void path_leave(struct walk *w, const struct bounce *b, const float direction[3], struct scene_ray *ray)
{
    if (PATH_PLAIN || w->film != NULL)
        scene_ray_leave(&b->hit, b->offset_mm, direction, ray);
    else
        fiber_walk_leave(w->s->model, &b->hit, b->offset_mm, direction, w->rng, ray);
}

/* A lamp and the strip of it that a narrow lobe sees from a bounce. */
struct seen_lamp {
    const struct lamp *lamp;
    const struct lamp_strip *strip; /* NULL: no narrow lobe meets the lamp */
    float weight;                   /* multiple-importance weight of all connections to it, in [0, 1] */
};

/* Next-event estimation from a bounce to the point of the lamp that u draws. Returns the incident light as stored in
 * path_step.light, or 0 if the light is occluded. */
static float connect_point(struct walk *w, const struct seen_lamp *seen, const float u[2], const struct bounce *b,
                           float wi[3])
{
    const struct path_setting *s = w->s;
    const struct lamp *lamp = seen->lamp;
    float direction[3], pdf_lamp, s_rgb[3];
    if (!lamp_sample(lamp, b->position_mm, u, direction, &pdf_lamp)) return 0;
    if (seen->strip != NULL) pdf_lamp *= 1 + lamp_strip_ratio(seen->strip, u); /* of both points together */
    if (path_walk_hides(w, direction)) return 0;
    fiber_frame_to_local(&b->frame, direction, wi);
    float pdf = path_scatter(w, b, wi, s_rgb, NULL);
    float heuristic = path_walk_connects_all(w) ? 1 : lights_power_heuristic(pdf_lamp, pdf), value[3],
          light = seen->weight * lamp_radiance(lamp, direction) * fiber_frame_cos_theta(wi) / pdf_lamp * heuristic;
    for (int c = 0; c < 3; c++) value[c] = w->throughput[c] * s_rgb[c] * light;
    float most = path_value_largest(value), survival;
    if (!(most > 0)) {
        path_value_keep_nan(w->out->radiance, value);
        return 0;
    }
    if (most < PATH_SURFACE_SHADOW_BELOW) { /* hardly any light: trace few of these shadow rays, for more each */
        if (!path_value_survives(most, PATH_SURFACE_SHADOW_BELOW, w->rng, &survival)) return 0;
        light /= survival;
        for (int c = 0; c < 3; c++) value[c] /= survival;
    }
    struct scene_ray shadow;
    path_leave(w, b, direction, &shadow);
    if (scene_occluded(s->scene, &shadow)) return 0;
    path_factor_apply(w, b, direction, value);
    path_scatter_score(w, b, wi);
    path_add_light(w, value, w->score);
    return light;
}

/* Next-event estimation from a bounce to a random point of the lamp and, if a narrow lobe meets the lamp, to one of the
 * strip that it sees. weight: multiple-importance weight of these connections, in [0, 1]. Sets the strip if the walk
 * has strips. Returns the incident light from the random point, as stored in path_step.light, or 0 if the point is
 * occluded. */
static float path_connect_lamp(struct walk *w, const struct lamp *lamp, float weight, const struct bounce *b,
                               struct lamp_strip *strip, float wi[3])
{
    struct seen_lamp seen = {.lamp = lamp, .weight = weight};
    float u[2], of_lamp[2], unused[3];
    if (w->has_strips) {
        lamp_strip_init(strip, lamp, b->position_mm, b->frame.u, b->wo[0], w->s->lobe_rad[w->i_set]);
        strip->used = strip->used && !path_walk_on_film(w);
        if (strip->used) seen.strip = strip;
    }
    for (int a = 0; a < 2; a++) u[a] = rng_float(w->rng);
    float light = connect_point(w, &seen, u, b, wi);
    if (seen.strip == NULL) return light;
    for (int a = 0; a < 2; a++) u[a] = rng_float(w->rng);
    lamp_strip_sample(strip, u, of_lamp);
    connect_point(w, &seen, of_lamp, b, unused);
    return light;
}

/* Next-event estimation from a bounce to one direction of the image environment. */
static void path_connect_image(struct walk *w, const struct bounce *b)
{
    const struct path_setting *s = w->s;
    float u[2], direction[3], radiance[3], pdf_image, wi[3], s_rgb[3], value[3], survival;
    u[0] = rng_float(w->rng);
    u[1] = rng_float(w->rng);
    if (!lights_sample_image(&s->lights, u, direction, radiance, &pdf_image)) return;
    if (path_walk_hides(w, direction)) return;
    fiber_frame_to_local(&b->frame, direction, wi);
    float pdf = path_scatter(w, b, wi, s_rgb, NULL);
    float weight = fiber_frame_cos_theta(wi) / pdf_image * lights_power_heuristic(pdf_image, pdf);
    for (int c = 0; c < 3; c++) {
        radiance[c] *= weight;
        value[c] = w->throughput[c] * s_rgb[c] * radiance[c];
    }
    float most = path_value_largest(value);
    if (!(most > 0)) {
        path_value_keep_nan(w->out->radiance, value);
        return;
    }
    if (most < PATH_SURFACE_SHADOW_BELOW) {
        if (!path_value_survives(most, PATH_SURFACE_SHADOW_BELOW, w->rng, &survival)) return;
        for (int c = 0; c < 3; c++) {
            radiance[c] /= survival;
            value[c] /= survival;
        }
    }
    struct scene_ray shadow;
    path_leave(w, b, direction, &shadow);
    if (scene_occluded(s->scene, &shadow)) return;
    path_factor_apply(w, b, direction, value);
    path_scatter_score(w, b, wi);
    path_add_light_to_all(w, value, w->score);
    if (path_walk_recorded(w)) {
        memcpy(w->step->image_wi, wi, sizeof wi);
        memcpy(w->step->image, radiance, sizeof radiance);
    }
}

#endif
