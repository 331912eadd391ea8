#include "renderer/fast/deep_shade.h"

#include "renderer/fast/fast_setting.h"
#include "renderer/fast/layer_light.h"
#include "renderer/scene/scene_place.h"

#include <string.h>

/* The place that is seen, in the flat cloth. */
struct deep_hit {
    const struct scene_hit *hit;
    double offset_mm[2];
    float position_mm[3]; /* true place in the scene */
    float row[3][3];      /* of the rotation into the flat cloth at the hit */
    bool edge;            /* it is seen through the border of a bent cloth, whose place and normal follow */
    float border_mm[3], border_normal[3];
    struct deep_seen seen;
};

/* What takes the light of a direction. */
struct deep_sum {
    float *rgb;                 /* with the factor of the option; or NULL */
    float (*term)[DEEP_FACTOR]; /* [3]: times each term */
};

static void turn(const float row[3][3], const float d[3], float out[3])
{
    for (int k = 0; k < 3; k++) out[k] = row[k][0] * d[0] + row[k][1] * d[1] + row[k][2] * d[2];
}

/* The hit moved to a place where light from a direction may have entered the cloth. */
static void enter_beside(const struct fast_setting *s, const struct deep_hit *h, const float direction[3],
                         struct rng *rng, struct scene_hit *at)
{
    const struct deep_light *deep = &s->option->tables->deep;
    float wi[3], shift[2];
    double normal[2];
    if (!scene_is_bent(s->path.scene)) {
        *at = *h->hit;
        return;
    }
    turn(h->row, direction, wi);
    deep_light_shift(deep, h->seen.wo, wi, shift);
    rng_normal_pair(rng, normal);
    for (int a = 0; a < 2; a++) shift[a] += (float)normal[a] * deep->spread_mm;
    scene_hit_beside(s->path.scene, h->hit, shift, at);
}

static void add_light(const struct fast_setting *s, const struct deep_hit *h, const float direction[3], float rgb[3],
                      const struct deep_sum *sum)
{
    float wi[3], term[DEEP_FACTOR];
    const struct deep_factor *factor = s->option->factor;
    if (factor != NULL || sum->rgb == NULL) {
        turn(h->row, direction, wi);
        deep_factor_terms(&h->seen, wi, term);
    }
    for (int c = 0; c < 3 && sum->rgb == NULL; c++)
        for (int k = 0; k < DEEP_FACTOR; k++) sum->term[c][k] += rgb[c] * term[k];
    if (sum->rgb == NULL) return;
    if (factor != NULL) deep_factor_apply(factor, term, rgb);
    for (int c = 0; c < 3; c++) sum->rgb[c] += rgb[c];
}

/* The same where a cut edge is seen, which light enters straight. */
static void add_at_edge(const struct fast_setting *s, const struct deep_hit *h, const float direction[3],
                        const float scale[3], const struct deep_sum *sum)
{
    float cosine = 0;
    for (int a = 0; a < 3; a++) cosine += direction[a] * h->border_normal[a];
    if (!(cosine > 0) || scene_shell_covers(s->path.scene, h->border_mm, direction)) return;
    for (int c = 0; c < 3; c++) {
        const float light = scale[c] * cosine * deep_light_pile(&s->option->tables->deep, (size_t)c);
        if (sum->rgb != NULL)
            sum->rgb[c] += light;
        else
            sum->term[c][0] += light;
    }
}

/* Adds light of one direction; a surface that faces it has the irradiance pi times scale. The light enters beside
 * the hit, where a bent cloth has another normal and other shadows. */
static void add_from(const struct fast_setting *s, const struct deep_hit *h, const float direction[3],
                     const float scale[3], struct rng *rng, const struct deep_sum *sum)
{
    static const float no_shift[2] = {0, 0};
    const struct scene *scene = s->path.scene;
    struct scene_hit at;
    struct scene_place place;
    float row[3][3], wi[3], rgb[3] = {0, 0, 0};
    if (h->edge) {
        add_at_edge(s, h, direction, scale, sum);
        return;
    }
    enter_beside(s, h, direction, rng, &at);
    scene_place_find(scene, &at, h->offset_mm, &place);
    if (scene_shell_shades(scene, &at, &place, no_shift, direction)) return;
    scene_place_rotation(&place, row);
    turn((const float(*)[3])row, direction, wi);
    deep_light_add(&s->option->tables->deep, h->seen.tangent, h->seen.wo, wi, scale, rgb);
    add_light(s, h, direction, rgb, sum);
}

/* Adds light that comes from another part of a bent cloth to a place beside the hit, on either side, in a direction
 * that is chosen by the cosine there. */
static void add_from_layers(const struct fast_setting *s, const struct deep_hit *h, struct rng *rng,
                            const struct deep_sum *sum)
{
    static const float no_shift[2] = {0, 0};
    const struct deep_light *deep = &s->option->tables->deep;
    struct scene_hit at;
    struct scene_place place;
    float row[3][3], wi[3], direction[3], point[3], light[3], scale[3], rgb[3] = {0, 0, 0};
    layer_light_direction(rng, wi);
    if (deep->n_side > 1 && rng_float(rng) < 0.5f) wi[2] = -wi[2];
    for (int a = 0; a < 3; a++) direction[a] = wi[0] * h->row[0][a] + wi[1] * h->row[1][a] + wi[2] * h->row[2][a];
    enter_beside(s, h, direction, rng, &at);
    scene_place_find(s->path.scene, &at, h->offset_mm, &place);
    scene_place_rotation(&place, row);
    for (int a = 0; a < 3; a++) direction[a] = wi[0] * row[0][a] + wi[1] * row[1][a] + wi[2] * row[2][a];
    scene_surface_point(s->path.scene, &at, &place, no_shift, direction, point);
    layer_light_arriving(s, point, direction, rng, light);
    if (!(light[0] + light[1] + light[2] > 0)) return;
    for (int c = 0; c < 3; c++) scale[c] = light[c] * (float)deep->n_side / fabsf(wi[2]);
    deep_light_add(deep, h->seen.tangent, h->seen.wo, wi, scale, rgb);
    add_light(s, h, direction, rgb, sum);
}

static void describe(const struct fast_setting *s, const struct scene_hit *hit, const struct scene_ray *ray,
                     struct deep_hit *h)
{
    struct scene_place place;
    float back[3];
    *h = (struct deep_hit){.hit = hit};
    for (int a = 0; a < 3; a++) {
        back[a] = -ray->direction[a];
        if (a < 2) h->offset_mm[a] = ray->offset_mm[a];
        h->position_mm[a] = (float)((double)hit->position_mm[a] + (a < 2 ? h->offset_mm[a] : 0.0));
    }
    scene_place_find(s->path.scene, hit, h->offset_mm, &place);
    scene_place_rotation(&place, h->row);
    turn((const float(*)[3])h->row, back, h->seen.wo);
    turn((const float(*)[3])h->row, hit->normal, h->seen.normal);
    scene_place_to_cloth(&place, hit->tangent, h->seen.tangent);
    h->edge = scene_border_seen(s->path.scene, hit, back, h->border_mm, h->border_normal);
    h->seen.depth = (float)((double)place.position_mm[2] / s->option->tables->bottom_mm);
}

static void shade(const struct fast_setting *s, const struct deep_hit *h, struct rng *rng, const struct deep_sum *sum)
{
    const struct lights *l = &s->path.lights;
    if (scene_is_bent(s->path.scene) && !h->edge) add_from_layers(s, h, rng, sum);
    float direction[3], pdf, scale[3], u[2];
    if (l->has_lamp) {
        for (int k = 0; k < 2; k++) u[k] = rng_float(rng);
        if (lamp_sample(&l->lamp, h->position_mm, u, direction, &pdf)) {
            for (int c = 0; c < 3; c++) scale[c] = lamp_radiance(&l->lamp, direction) / pdf * (float)M_1_PI;
            add_from(s, h, direction, scale, rng, sum);
        }
    }
    if (s->mixture.n == 0) return;
    light_mixture_sample(&s->mixture, rng_float(rng), direction, scale);
    add_from(s, h, direction, scale, rng, sum);
}

void deep_shade_begin(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                      float rgb[3])
{
    struct deep_hit h;
    describe(context, hit, ray, &h);
    shade(context, &h, rng, &(struct deep_sum){.rgb = rgb});
}

void deep_shade_terms(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                      float sum[3][DEEP_FACTOR])
{
    struct deep_hit h;
    describe(context, hit, ray, &h);
    shade(context, &h, rng, &(struct deep_sum){.term = sum});
}
