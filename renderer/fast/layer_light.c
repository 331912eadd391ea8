#include "renderer/fast/layer_light.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/scene/scene_place.h"

#include <math.h>
#include <string.h>

enum { MOST_LAYERS = 8 };

void layer_light_direction(struct rng *rng, float local[3])
{
    const float u = rng_float(rng), angle = 2 * (float)M_PI * rng_float(rng), r = sqrtf(u);
    local[0] = r * cosf(angle);
    local[1] = r * sinf(angle);
    local[2] = sqrtf(1 - u);
}

/* Adds the radiance that a layer sends towards the ray from light of one direction. A surface that faces it has the
 * irradiance pi times scale. */
static void add_lit(const struct fast_setting *s, const struct scene_layer *layer, const float direction[3],
                    const float scale[3], const float weight[3], float rgb[3])
{
    float cosine = 0;
    for (int a = 0; a < 3; a++) cosine += direction[a] * layer->normal[a];
    const bool front = cosine > 0;
    const float *share = front ? s->option->tables->deep.back : s->option->tables->deep.through;
    if (!(share[0] + share[1] + share[2] > 0)) return;
    if (scene_shell_covers(s->path.scene, front ? layer->front_mm : layer->behind_mm, direction)) return;
    for (int c = 0; c < 3; c++) rgb[c] += weight[c] * share[c] * fabsf(cosine) * scale[c];
}

static void add_lights(const struct fast_setting *s, const struct scene_layer *layer, struct rng *rng,
                       const float weight[3], float rgb[3])
{
    const struct lights *l = &s->path.lights;
    float direction[3], pdf, scale[3], u[2];
    if (l->has_lamp) {
        for (int k = 0; k < 2; k++) u[k] = rng_float(rng);
        if (lamp_sample(&l->lamp, layer->front_mm, u, direction, &pdf)) {
            for (int c = 0; c < 3; c++) scale[c] = lamp_radiance(&l->lamp, direction) / pdf * (float)M_1_PI;
            add_lit(s, layer, direction, scale, weight, rgb);
        }
    }
    if (s->mixture.n == 0) return;
    light_mixture_sample(&s->mixture, rng_float(rng), direction, scale);
    add_lit(s, layer, direction, scale, weight, rgb);
}

/* Light that comes to the layer from other layers, on its front or from behind. False: the estimate ends. */
static bool go_on(const struct deep_light *shares, const struct scene_layer *layer, struct rng *rng, float weight[3],
                  float point_mm[3], float direction[3])
{
    float back = 0, through = 0, local[3];
    struct fiber_frame frame;
    for (int c = 0; c < 3; c++) {
        back += weight[c] * shares->back[c];
        through += weight[c] * shares->through[c];
    }
    const float before = weight[0] + weight[1] + weight[2], chance = fminf((back + through) / before, 0.95f);
    if (!(chance > 0) || rng_float(rng) >= chance) return false;
    const bool front = rng_float(rng) * (back + through) < back;
    const float inv = (back + through) / ((front ? back : through) * chance);
    for (int c = 0; c < 3; c++) weight[c] *= (front ? shares->back[c] : shares->through[c]) * inv;
    layer_light_direction(rng, local);
    fiber_frame_from(&frame, layer->normal);
    const float along = front ? local[2] : -local[2];
    for (int a = 0; a < 3; a++) direction[a] = along * frame.u[a] + local[0] * frame.v[a] + local[1] * frame.w[a];
    memcpy(point_mm, front ? layer->front_mm : layer->behind_mm, 3 * sizeof *point_mm);
    return true;
}

void layer_light_arriving(const struct fast_setting *s, const float point_mm[3], const float direction[3],
                          struct rng *rng, float rgb[3])
{
    float from[3], d[3], weight[3] = {1, 1, 1};
    struct scene_layer layer;
    memcpy(from, point_mm, sizeof from);
    memcpy(d, direction, sizeof d);
    memset(rgb, 0, 3 * sizeof *rgb);
    for (int i = 0; i < MOST_LAYERS && scene_shell_meets(s->path.scene, from, d, &layer); i++) {
        add_lights(s, &layer, rng, weight, rgb);
        if (!go_on(&s->option->tables->deep, &layer, rng, weight, from, d)) return;
    }
}
