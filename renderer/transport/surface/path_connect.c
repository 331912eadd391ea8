#include "renderer/transport/surface/path_connect.h"

#include "renderer/transport/path_value.h"
#include "renderer/transport/surface/path_factor.h"
#include "renderer/transport/surface/path_scatter.h"

#include <string.h>

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

float path_connect_lamp(struct walk *w, const struct lamp *lamp, float weight, const struct bounce *b,
                        struct lamp_strip *strip, float wi[3])
{
    struct seen_lamp seen = {.lamp = lamp, .weight = weight};
    float u[2], of_lamp[2], unused[3];
    if (w->has_strips) {
        lamp_strip_init(strip, lamp, b->position_mm, b->frame.u, b->wo[0], w->s->lobe_rad[w->i_set]);
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

void path_connect_image(struct walk *w, const struct bounce *b)
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
    if (w->step != NULL) {
        memcpy(w->step->image_wi, wi, sizeof wi);
        memcpy(w->step->image, radiance, sizeof radiance);
    }
}
