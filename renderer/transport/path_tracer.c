#include "renderer/transport/path_tracer.h"

#include <math.h>
#include <string.h>

#ifndef ROULETTE_BELOW
#define ROULETTE_BELOW 0.3f
#endif
#ifndef SHADOW_BELOW
#define SHADOW_BELOW 0.01f
#endif

void path_setting_init(struct path_setting *s, const struct scene *scene, const struct scattering_model *model,
                       const struct scattering_state *state, const struct configuration *c, bool want_jacobian)
{
    memset(s, 0, sizeof *s);
    s->scene = scene;
    s->model = model;
    s->state = state;
    lamp_init(&s->lamp, c);
    s->has_lamp = true;
    s->roulette_below = ROULETTE_BELOW;
    s->want_jacobian = want_jacobian;
}

/* Fiber frame: u along the fiber, v and w any two perpendicular to it (Duff et al. 2017, "Building an orthonormal
 * basis, revisited"). */
struct frame {
    float u[3], v[3], w[3];
};

static inline void frame_from(struct frame *f, const float u[3])
{
    float sign = copysignf(1, u[2]), a = -1 / (sign + u[2]), b = u[0] * u[1] * a;
    memcpy(f->u, u, sizeof f->u);
    f->v[0] = 1 + sign * u[0] * u[0] * a;
    f->v[1] = sign * b;
    f->v[2] = -sign * u[0];
    f->w[0] = b;
    f->w[1] = sign + u[1] * u[1] * a;
    f->w[2] = -u[1];
}

static inline float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void to_local(const struct frame *f, const float d[3], float out[3])
{
    out[0] = dot(f->u, d);
    out[1] = dot(f->v, d);
    out[2] = dot(f->w, d);
}

static inline void to_world(const struct frame *f, const float d[3], float out[3])
{
    for (int a = 0; a < 3; a++) out[a] = d[0] * f->u[a] + d[1] * f->v[a] + d[2] * f->w[a];
    float inv = 1 / sqrtf(dot(out, out));
    for (int a = 0; a < 3; a++) out[a] *= inv;
}

static inline float cos_theta(const float local[3]) { return sqrtf(local[1] * local[1] + local[2] * local[2]); }

static inline float power_heuristic(float a, float b)
{
    float r = b / a;
    return 1 / (1 + r * r);
}

static inline void unwrapped(const float local_mm[3], const double offset_mm[2], float out[3])
{
    out[0] = (float)((double)local_mm[0] + offset_mm[0]);
    out[1] = (float)((double)local_mm[1] + offset_mm[1]);
    out[2] = local_mm[2];
}

/* The state that a path carries. */
struct walk {
    const struct path_setting *s;
    struct rng *rng;
    struct path_result *out;
    struct path_step *step; /* being recorded, or NULL */
    size_t n_score;
    float throughput[3];
    float h[PATH_N_DERIVATIVE]; /* running score sums */
    float score[PATH_N_DERIVATIVE];
};

/* Adds value * (1, H + score) to the result; score NULL: the last step's are in H already. */
static inline void add_light(struct walk *w, const float value[3], const float *score)
{
    for (int c = 0; c < 3; c++) w->out->radiance[c] += value[c];
    if (!w->s->want_jacobian) return;
    size_t n = w->s->model->n_param;
    for (size_t c = 0; c < 3; c++)
        for (size_t p = c * n; p < (c + 1) * n; p++)
            w->out->jac[p] += value[c] * (w->h[p] + (score != NULL ? score[p] : 0));
}

/* A model that gives no number must be found out (STATUS_NUMERIC), not taken for black. */
static void keep_nan(struct walk *w, const float value[3])
{
    if (isnan(value[0] + value[1] + value[2])) w->out->radiance[0] = NAN;
}

/* Next-event estimation: one point on the lamp. */
static void connect_lamp(struct walk *w, const struct scene_ray *ray, const struct scene_hit *hit,
                         const struct frame *f, const float wo[3])
{
    const struct path_setting *s = w->s;
    float position[3], u[2], direction[3], pdf_lamp, wi[3], s_rgb[3];
    unwrapped(hit->position_mm, ray->offset_mm, position);
    u[0] = rng_float(w->rng);
    u[1] = rng_float(w->rng);
    if (!lamp_sample(&s->lamp, position, u, direction, &pdf_lamp)) return;
    if (direction[2] <= 0 && scene_has_black_sheet(s->scene)) return;
    to_local(f, direction, wi);
    float pdf = s->model->eval_pdf(s->state, wi, wo, w->throughput, s_rgb, s->want_jacobian ? w->score : NULL);
    float light = s->lamp.radiance * cos_theta(wi) / pdf_lamp * power_heuristic(pdf_lamp, pdf), value[3], most = 0;
    for (int c = 0; c < 3; c++) {
        value[c] = w->throughput[c] * s_rgb[c] * light;
        most = value[c] > most ? value[c] : most;
    }
    if (!(most > 0)) {
        keep_nan(w, value);
        return;
    }
    if (most < SHADOW_BELOW) { /* hardly any light: trace few of these shadow rays, for more each */
        float survival = most / SHADOW_BELOW;
        if (rng_float(w->rng) >= survival) return;
        light /= survival;
        for (int c = 0; c < 3; c++) value[c] /= survival;
    }
    struct scene_ray shadow;
    scene_ray_leave(hit, ray->offset_mm, direction, &shadow);
    if (scene_occluded(s->scene, &shadow)) return;
    add_light(w, value, w->score);
    if (w->step != NULL) {
        memcpy(w->step->light_wi, wi, sizeof wi);
        w->step->light = light;
    }
}

/* Radiance that a ray meets beyond the cloth. pdf: of the scattering sample that made it, 0 for a camera ray. */
static void add_beyond(struct walk *w, const struct scene_ray *ray, float pdf)
{
    const struct path_setting *s = w->s;
    if (ray->direction[2] < 0 && scene_has_black_sheet(s->scene)) return;
    float beyond[3] = {0, 0, 0}, value[3];
    if (s->has_lamp) {
        float position[3];
        unwrapped(ray->origin_mm, ray->offset_mm, position);
        float pdf_lamp = lamp_pdf(&s->lamp, position, ray->direction);
        float share = pdf_lamp > 0 ? s->lamp.radiance * (pdf > 0 ? power_heuristic(pdf, pdf_lamp) : 1) : 0;
        for (int c = 0; c < 3; c++) beyond[c] = share;
    }
    for (int c = 0; c < 3 && s->has_environment; c++) beyond[c] += s->environment[c];
    for (int c = 0; c < 3; c++) value[c] = w->throughput[c] * beyond[c];
    if (value[0] + value[1] + value[2] > 0) add_light(w, value, NULL);
    if (w->step != NULL) memcpy(w->step->escape, beyond, sizeof beyond);
}

/* Scatters the ray at the hit. False: roulette (or a dark fiber) ends the path. */
static bool scatter(struct walk *w, struct scene_ray *ray, const struct scene_hit *hit, const struct frame *f,
                    const float wo[3], float *pdf_out)
{
    const struct path_setting *s = w->s;
    float u[3], wi[3], s_rgb[3], direction[3], survival = 1;
    for (int a = 0; a < 3; a++) u[a] = rng_float(w->rng);
    s->model->sample(s->state, wo, w->throughput, u, wi);
    float pdf = s->model->eval_pdf(s->state, wi, wo, w->throughput, s_rgb, s->want_jacobian ? w->score : NULL);
    float weight = cos_theta(wi) / pdf, most = 0, next[3];
    for (int c = 0; c < 3; c++) {
        next[c] = w->throughput[c] * s_rgb[c] * weight;
        most = next[c] > most ? next[c] : most;
    }
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
    if (w->step != NULL) {
        memcpy(w->step->wi, wi, sizeof wi);
        w->step->weight = weight / survival;
    }
    to_world(f, wi, direction);
    double offset[2] = {ray->offset_mm[0], ray->offset_mm[1]};
    scene_ray_leave(hit, offset, direction, ray);
    *pdf_out = pdf;
    return true;
}

static struct path_step *next_step(struct path_record *r)
{
    if (r == NULL) return NULL;
    size_t i = r->n_step++;
    if (i >= r->capacity) return NULL;
    memset(&r->step[i], 0, sizeof r->step[i]);
    return &r->step[i];
}

void path_trace(const struct path_setting *s, struct scene_ray *ray, struct rng *rng, struct path_result *out,
                struct path_record *record)
{
    struct walk w = {.s = s, .rng = rng, .out = out, .n_score = 3 * s->model->n_param, .throughput = {1, 1, 1}};
    memset(out, 0, sizeof *out);
    float pdf = 0;
    for (uint32_t i = 0; i < PATH_MAX_VERTEX; i++) {
        struct scene_hit hit;
        if (!scene_trace(s->scene, ray, &hit)) {
            add_beyond(&w, ray, pdf);
            return;
        }
        out->n_vertex++;
        w.step = next_step(record);
        struct frame f;
        frame_from(&f, hit.tangent);
        float back[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]}, wo[3];
        to_local(&f, back, wo);
        if (w.step != NULL) memcpy(w.step->wo, wo, sizeof wo);
        if (s->has_lamp) connect_lamp(&w, ray, &hit, &f, wo);
        if (!scatter(&w, ray, &hit, &f, wo, &pdf)) return;
    }
}
