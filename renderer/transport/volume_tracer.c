#include "renderer/transport/volume_tracer.h"

#include "renderer/transport/fiber_frame.h"

#define VOLUME_ROULETTE_BELOW 0.3f
#define VOLUME_SHADOW_BELOW 0.02f
#define VOLUME_HEADROOM 1.25f
#define NO_VOXEL SIZE_MAX
#define OUTSIDE (SIZE_MAX - 1)
enum { VOLUME_MAX_LOOKUP = 200000, N_AHEAD = 4 }; /* 4 ahead: 10 % faster than 1, as fast as 8 */

void volume_setting_init(struct volume_setting *s, const struct volume_scene *scene, const struct phase_model *model,
                         const struct phase_state *state, double multiplier_per_m, const struct configuration *c,
                         bool want_jacobian)
{
    memset(s, 0, sizeof *s);
    s->scene = scene;
    s->model = model;
    s->state = state;
    s->extinction = model->extinction(state);
    s->multiplier_per_m = (float)multiplier_per_m;
    s->majorant_density = VOLUME_HEADROOM * scene->largest_density * s->extinction->largest;
    s->majorant_per_mm = (float)(1e-3 * multiplier_per_m) * s->majorant_density;
    s->has_lamp = c != NULL && c->light != LIGHT_NO_LAMP;
    if (s->has_lamp) lamp_init(&s->lamp, c);
    for (int k = 0; k < 3 && c != NULL; k++) {
        s->environment[k] = (float)c->environment_rgb[k];
        if (s->environment[k] > 0) s->has_environment = true;
    }
    s->roulette_below = VOLUME_ROULETTE_BELOW;
    s->shadow_below = VOLUME_SHADOW_BELOW;
    s->want_jacobian = want_jacobian;
}

/* Derivatives of ln of a flight's contribution: by ln d, and by the parameter of s(w). */
struct flight_score {
    float ln_d, param;
};

/* The state that a path carries. */
struct walk {
    const struct volume_setting *s;
    struct rng *rng;
    struct volume_result *out;
    size_t n_score;
    float throughput[3];
    struct flight_score flight;
    float h[VOLUME_N_DERIVATIVE]; /* running score sums of the phase function, [c * n_param + p] */
    float score[VOLUME_N_DERIVATIVE];
};

/* Moves by one tentative flight. False: out of the slab. */
static inline bool advance(const struct volume_scene *v, float step_mm, struct volume_ray *ray)
{
    for (int a = 0; a < 3; a++) ray->at[a] += step_mm * ray->per_mm[a];
    for (int a = 0; a < 2; a++)
        if (!(ray->at[a] >= 0 && ray->at[a] < v->n_voxel[a])) {
            float tiles = floorf(ray->at[a] / v->n_voxel[a]);
            ray->at[a] -= tiles * v->n_voxel[a];
            ray->offset_mm[a] += (double)tiles * (double)v->n_voxel[a] * (double)v->voxel_mm[a];
        }
    return ray->at[2] >= v->low && ray->at[2] < v->high;
}

/* The voxel that the ray is in, or NO_VOXEL in an empty brick. Both loads that a voxel needs are started. */
static inline size_t voxel_of(const struct volume_scene *v, const struct volume_ray *ray)
{
    const struct direction_volume *volume = v->volume;
    size_t i = (size_t)ray->at[0], j = (size_t)ray->at[1], k = (size_t)ray->at[2];
    i = i < volume->n[0] ? i : volume->n[0] - 1; /* rounding may put a wrapped point on the far face */
    j = j < volume->n[1] ? j : volume->n[1] - 1;
    if (!volume_scene_may_hold(v, i, j, k)) return NO_VOXEL;
    size_t at = volume_index(volume->n, i, j, k);
    __builtin_prefetch(&volume->density[at]);
    __builtin_prefetch(&volume->octahedral[2 * at]);
    return at;
}

/* Extinction over the majorant at a voxel that is not empty, and its derivative by the parameter of s(w). */
static inline float ratio_at(const struct volume_setting *s, size_t i_voxel, const float w[3], float tangent[3],
                             float *d_ratio)
{
    const struct direction_volume *v = s->scene->volume;
    volume_scene_direction(s->scene, i_voxel, tangent);
    float c = dot(tangent, w), d_value, scale = (float)v->density[i_voxel] / (255 * s->majorant_density);
    float value = phase_extinction_at(s->extinction, sqrtf(fmaxf(0, 1 - c * c)), &d_value);
    *d_ratio = scale * d_value;
    return scale * value;
}

static inline float free_flight_mm(const struct volume_setting *s, struct rng *rng)
{
    return -logf(1 - rng_float(rng)) / s->majorant_per_mm;
}

/* The next tentative collisions along a ray, drawn together: where they lie does not depend on what is found there, and
 * memory answers all their loads at once. Those behind a real collision are never looked at; flights have no memory, so
 * leaving them changes nothing. */
struct tentative {
    struct volume_ray ray[N_AHEAD];
    size_t voxel[N_AHEAD]; /* or NO_VOXEL, OUTSIDE */
    uint32_t n;
};

static inline void draw_tentative(struct walk *w, const struct volume_ray *from, struct tentative *t)
{
    const struct volume_setting *s = w->s;
    struct volume_ray ray = *from;
    for (t->n = 0; t->n < N_AHEAD;) {
        w->out->n_lookup++;
        bool inside = advance(s->scene, free_flight_mm(s, w->rng), &ray);
        t->ray[t->n] = ray;
        t->voxel[t->n++] = inside ? voxel_of(s->scene, &ray) : OUTSIDE;
        if (!inside) return;
    }
}

/* Woodcock tracking to the next real collision. False: the ray leaves the cloth (or wanders between its planes without
 * end). */
static bool collide(struct walk *w, struct volume_ray *ray, float tangent[3])
{
    const struct volume_setting *s = w->s;
    for (uint32_t n = 0; n < VOLUME_MAX_LOOKUP; n += N_AHEAD) {
        struct tentative t;
        draw_tentative(w, ray, &t);
        for (uint32_t k = 0; k < t.n; k++) {
            size_t i = t.voxel[k];
            if (i == OUTSIDE) return false;
            if (i == NO_VOXEL || s->scene->volume->density[i] == 0) continue;
            float d_ratio, ratio = ratio_at(s, i, ray->direction, tangent, &d_ratio);
            if (rng_float(w->rng) < ratio) {
                w->flight.ln_d += 1;
                w->flight.param += d_ratio / ratio;
                *ray = t.ray[k];
                return true;
            }
            float inv = 1 / (1 - ratio);
            w->flight.ln_d -= ratio * inv;
            w->flight.param -= d_ratio * inv;
        }
        *ray = t.ray[N_AHEAD - 1];
    }
    return false;
}

/* Ratio tracking from a point to the edge of the cloth: an unbiased estimate of the transmittance, with the derivatives
 * of its logarithm. worth: what a transmittance of 1 would add; little light is thinned out at random. */
static float transmittance(struct walk *w, struct volume_ray ray, float worth, struct flight_score *score)
{
    const struct volume_setting *s = w->s;
    float t = 1;
    *score = (struct flight_score){0, 0};
    for (uint32_t n = 0; n < VOLUME_MAX_LOOKUP; n += N_AHEAD) {
        if (t * worth < s->shadow_below) {
            float survival = t * worth / s->shadow_below;
            if (rng_float(w->rng) >= survival) return 0;
            t /= survival;
        }
        struct tentative ahead;
        draw_tentative(w, &ray, &ahead);
        for (uint32_t k = 0; k < ahead.n; k++) {
            size_t i = ahead.voxel[k];
            if (i == OUTSIDE) return t;
            if (i == NO_VOXEL || s->scene->volume->density[i] == 0) continue;
            float tangent[3], d_ratio, ratio = ratio_at(s, i, ray.direction, tangent, &d_ratio), inv = 1 / (1 - ratio);
            t *= 1 - ratio;
            score->ln_d -= ratio * inv;
            score->param -= d_ratio * inv;
        }
        ray = ahead.ray[N_AHEAD - 1];
    }
    return 0;
}

/* Adds value * (1, H + scores) to the result; score NULL: the last step's are in H already. */
static void add_light(struct walk *w, const float value[3], const float *score, const struct flight_score *shadow)
{
    for (int c = 0; c < 3; c++) w->out->radiance[c] += value[c];
    if (!w->s->want_jacobian) return;
    size_t n = w->s->model->n_param;
    float ln_d = w->flight.ln_d + (shadow != NULL ? shadow->ln_d : 0);
    float param = w->flight.param + (shadow != NULL ? shadow->param : 0);
    for (size_t c = 0; c < 3; c++) {
        float *jac = w->out->jac + c * (n + 1);
        const float *h = w->h + c * n;
        for (size_t p = 0; p < n; p++) jac[p] += value[c] * (h[p] + (score != NULL ? score[c * n + p] : 0));
        if (w->s->extinction->i_param >= 0) jac[w->s->extinction->i_param] += value[c] * param;
        jac[n] += value[c] * ln_d / w->s->multiplier_per_m;
    }
}

/* A model that gives no number must be found out (STATUS_NUMERIC), not taken for black. */
static void keep_nan(struct walk *w, const float value[3])
{
    if (isnan(value[0] + value[1] + value[2])) w->out->radiance[0] = NAN;
}

static float largest(const float value[3])
{
    float most = value[0] > value[1] ? value[0] : value[1];
    return value[2] > most ? value[2] : most;
}

/* Next-event estimation: one point on the lamp. */
static void connect_lamp(struct walk *w, const struct volume_ray *ray, const struct fiber_frame *f, const float wo[3])
{
    const struct volume_setting *s = w->s;
    float position[3], u[2], direction[3], pdf_lamp, wi[3], f_rgb[3], value[3];
    volume_ray_position_mm(s->scene, ray, position);
    u[0] = rng_float(w->rng);
    u[1] = rng_float(w->rng);
    if (!lamp_sample(&s->lamp, position, u, direction, &pdf_lamp)) return;
    if (direction[2] <= 0 && s->scene->black_sheet) return;
    to_local(f, direction, wi);
    float pdf = s->model->eval_pdf(s->state, wi, wo, w->throughput, f_rgb, s->want_jacobian ? w->score : NULL);
    float light = s->lamp.radiance / pdf_lamp * power_heuristic(pdf_lamp, pdf);
    for (int c = 0; c < 3; c++) value[c] = w->throughput[c] * f_rgb[c] * light;
    float most = largest(value);
    if (!(most > 0)) {
        keep_nan(w, value);
        return;
    }
    struct volume_ray shadow = *ray;
    struct flight_score score;
    volume_ray_turn(s->scene, direction, &shadow);
    float t = transmittance(w, shadow, most, &score);
    if (!(t > 0)) return;
    for (int c = 0; c < 3; c++) value[c] *= t;
    add_light(w, value, w->score, &score);
}

/* Radiance that a ray meets beyond the cloth. origin: where it was scattered; pdf: of that sample, 0 for a camera ray.
 */
static void add_beyond(struct walk *w, const float origin_mm[3], const float direction[3], float pdf)
{
    const struct volume_setting *s = w->s;
    if (direction[2] < 0 && s->scene->black_sheet) return;
    float beyond[3] = {0, 0, 0}, value[3];
    if (s->has_lamp) {
        float pdf_lamp = lamp_pdf(&s->lamp, origin_mm, direction);
        float share = pdf_lamp > 0 ? s->lamp.radiance * (pdf > 0 ? power_heuristic(pdf, pdf_lamp) : 1) : 0;
        for (int c = 0; c < 3; c++) beyond[c] = share;
    }
    for (int c = 0; c < 3 && s->has_environment; c++) beyond[c] += s->environment[c];
    for (int c = 0; c < 3; c++) value[c] = w->throughput[c] * beyond[c];
    if (largest(value) > 0) add_light(w, value, NULL, NULL);
}

/* Scatters the ray where it is. False: roulette ends the path. */
static bool scatter(struct walk *w, struct volume_ray *ray, const struct fiber_frame *f, const float wo[3],
                    float *pdf_out)
{
    const struct volume_setting *s = w->s;
    float u[3], wi[3], f_rgb[3], direction[3], next[3], survival = 1;
    for (int a = 0; a < 3; a++) u[a] = rng_float(w->rng);
    s->model->sample(s->state, wo, w->throughput, u, wi);
    float pdf = s->model->eval_pdf(s->state, wi, wo, w->throughput, f_rgb, s->want_jacobian ? w->score : NULL);
    for (int c = 0; c < 3; c++) next[c] = w->throughput[c] * f_rgb[c] / pdf;
    float most = largest(next);
    if (!(most > 0)) {
        keep_nan(w, next);
        return false;
    }
    if (most < s->roulette_below) {
        survival = most / s->roulette_below;
        if (rng_float(w->rng) >= survival) return false;
    }
    for (int c = 0; c < 3; c++) w->throughput[c] = next[c] / survival;
    if (s->want_jacobian)
        for (size_t p = 0; p < w->n_score; p++) w->h[p] += w->score[p];
    to_world(f, wi, direction);
    volume_ray_turn(s->scene, direction, ray);
    *pdf_out = pdf;
    return true;
}

void volume_trace(const struct volume_setting *s, struct volume_ray *ray, struct rng *rng, struct volume_result *out)
{
    struct walk w = {.s = s, .rng = rng, .out = out, .n_score = 3 * s->model->n_param, .throughput = {1, 1, 1}};
    memset(out, 0, sizeof *out);
    float pdf = 0, origin_mm[3], tangent[3];
    for (uint32_t i = 0; i < VOLUME_MAX_VERTEX; i++) {
        volume_ray_position_mm(s->scene, ray, origin_mm);
        if (!collide(&w, ray, tangent)) {
            add_beyond(&w, origin_mm, ray->direction, pdf);
            return;
        }
        out->n_vertex++;
        struct fiber_frame f;
        fiber_frame_from(&f, tangent);
        float back[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]}, wo[3];
        to_local(&f, back, wo);
        if (s->has_lamp) connect_lamp(&w, ray, &f, wo);
        if (!scatter(&w, ray, &f, wo, &pdf)) return;
    }
}
