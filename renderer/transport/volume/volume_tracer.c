#include "renderer/transport/volume/volume_tracer.h"

#include "renderer/transport/path_value.h"
#include "renderer/transport/volume/volume_flight.h"

#define VOLUME_HEADROOM 1.25f
enum { VOLUME_MAX_LOOKUP = 200000, N_AT_ONCE = 16 };

float volume_majorant_density(const struct volume_scene *scene, const struct volume_parameters *p)
{
    return VOLUME_HEADROOM * scene->largest_density * p->model->extinction(p->state)->largest;
}

void volume_setting_init(struct volume_setting *s, const struct volume_scene *scene, const struct volume_parameters *p,
                         const struct configuration *c, bool want_jacobian)
{
    memset(s, 0, sizeof *s);
    s->scene = scene;
    s->model = p->model;
    s->state = p->state;
    s->extinction = p->model->extinction(p->state);
    s->multiplier_per_m = (float)p->multiplier_per_m;
    s->majorant_density = volume_majorant_density(scene, p);
    s->majorant_per_mm = (float)(1e-3 * p->multiplier_per_m) * s->majorant_density;
    s->inv_majorant_density = 1 / s->majorant_density;
    s->mean_step_mm = 1 / s->majorant_per_mm;
    if (c != NULL) lights_init(&s->lights, c);
    s->roulette_below = PATH_VOLUME_ROULETTE_BELOW;
    s->shadow_below = PATH_VOLUME_SHADOW_BELOW;
    s->want_jacobian = want_jacobian;
}

/* Derivatives of ln of a flight's contribution: by ln d, and by the parameter of s(w). */
struct flight_score {
    float ln_d, param;
};

/* Purpose of a ray: to find the next scattering event, or to connect a bounce to a light. */
enum connection { FLIGHT, LAMP, IMAGE };

/* One of the paths that are traced in turns. Its ray waits at a point for which the entry of the brick table, or the
 * voxel, has been prefetched but not yet read. */
struct volume_path {
    struct volume_ray ray;
    const int32_t *brick;
    const uint32_t *voxel; /* NULL: the brick is read next */
    enum connection purpose;
    uint32_t n_lookup; /* of the present ray */
    struct rng rng;
    struct volume_result *out;
    struct volume_record *record;
    float throughput[3], pdf; /* density of the last scattering sample; 0 for a camera ray */
    float origin_mm[3];
    struct flight_score flight;

    struct volume_ray bounce; /* at the last bounce */
    struct fiber_frame frame;
    float wo[3];

    float light_wi[3], light[3], light_max; /* unoccluded light of the connection, and its largest channel */
    float passed; /* estimated transmittance so far, divided by the probability that the ray was kept */
    float ratios; /* of a recorded path: transmittance without that division */
    struct flight_score shadow;

    float h[VOLUME_N_DERIVATIVE]; /* running score sums of the phase function, [c * n_param + p] */
};

/* The next event of the record, or NULL when nothing is recorded or the record is full. */
static struct volume_event *note(struct volume_path *l, enum volume_event_kind kind)
{
    struct volume_record *r = l->record;
    if (r == NULL || r->n_event++ >= r->capacity) return NULL;
    struct volume_event *e = &r->event[r->n_event - 1];
    memset(e, 0, sizeof *e);
    e->kind = kind;
    return e;
}

static void note_lookup(struct volume_path *l, enum volume_event_kind kind, const struct volume_lookup *k)
{
    struct volume_event *e = note(l, kind);
    if (e == NULL) return;
    e->density = k->density;
    e->sine = k->sine;
}

static void note_light(struct volume_path *l, enum volume_event_kind kind, const float *wi, const float weight[3])
{
    struct volume_event *e = note(l, kind);
    if (e == NULL) return;
    memcpy(e->weight, weight, sizeof e->weight);
    if (wi == NULL) return;
    memcpy(e->wi, wi, sizeof e->wi);
    memcpy(e->wo, l->wo, sizeof e->wo);
}

/* Adds value to the radiance and value * (H + scores) to the derivatives. score NULL: the scores of the last step are
 * part of H already. */
static void add_light(const struct volume_setting *s, struct volume_path *l, const float value[3], const float *score,
                      const struct flight_score *shadow)
{
    for (int c = 0; c < 3; c++) l->out->radiance[c] += value[c];
    if (!s->want_jacobian) return;
    size_t n = s->model->n_param;
    float ln_d = l->flight.ln_d + (shadow != NULL ? shadow->ln_d : 0);
    float param = l->flight.param + (shadow != NULL ? shadow->param : 0);
    for (size_t c = 0; c < 3; c++) {
        float *jac = l->out->jac + c * (n + 1);
        const float *h = l->h + c * n;
        for (size_t p = 0; p < n; p++) jac[p] += value[c] * (h[p] + (score != NULL ? score[c * n + p] : 0));
        if (s->extinction->i_param >= 0) jac[s->extinction->i_param] += value[c] * param;
        jac[n] += value[c] * ln_d / s->multiplier_per_m;
    }
}

/* Radiance that the path's ray meets beyond the cloth. */
static void add_beyond(const struct volume_setting *s, struct volume_path *l)
{
    const float *direction = l->ray.direction;
    if ((direction[2] < 0 && s->scene->black_sheet) || (l->pdf == 0 && s->lights.unseen)) return;
    float beyond[3] = {0, 0, 0}, value[3];
    if (s->lights.has_lamp) {
        float lamp = lights_lamp_beyond(&s->lights.lamp, l->origin_mm, direction, l->pdf);
        for (int c = 0; c < 3; c++) beyond[c] = lamp;
    }
    lights_add_environment(&s->lights, direction, l->pdf, beyond);
    for (int c = 0; c < 3; c++) value[c] = l->throughput[c] * beyond[c];
    if (!(path_value_largest(value) > 0)) return;
    add_light(s, l, value, NULL, NULL);
    note_light(l, VOLUME_BEYOND, NULL, beyond);
}

static bool connect(const struct volume_setting *s, struct volume_path *l, enum connection to);

/* The ray has left the cloth, or is lost in it after VOLUME_MAX_LOOKUP steps, when no light can be counted. False: the
 * path has ended. */
static bool leave(const struct volume_setting *s, struct volume_path *l, bool lost)
{
    if (l->purpose == FLIGHT) {
        if (!lost) add_beyond(s, l);
        return false;
    }
    if (!lost && l->passed > 0) {
        float value[3], score[VOLUME_N_DERIVATIVE], f_rgb[3];
        for (int c = 0; c < 3; c++) value[c] = l->light[c] * l->passed;
        if (s->want_jacobian) /* the scores are computed here because few connections arrive */
            s->model->eval_pdf(s->state, l->light_wi, l->wo, l->throughput, f_rgb, score);
        add_light(s, l, value, score, &l->shadow);
        note_light(l, VOLUME_ARRIVE, NULL, (float[3]){l->passed / l->ratios, 0, 0});
    }
    return connect(s, l, l->purpose + 1);
}

/* Moves the ray by skip_mm and on to the next tentative collision. False: the path has ended. */
static inline bool move_on(const struct volume_setting *s, struct volume_path *l, float skip_mm)
{
    l->voxel = NULL;
    l->out->n_lookup++;
    bool lost = ++l->n_lookup > VOLUME_MAX_LOOKUP;
    float step_mm = volume_flight_minus_log(rng_float(&l->rng)) * s->mean_step_mm;
    if (lost || !volume_flight_advance(s->scene, skip_mm + step_mm, &l->ray)) return leave(s, l, lost);
    l->brick = volume_flight_brick(s->scene, &l->ray);
    __builtin_prefetch(l->brick);
    return true;
}

/* Starts a ray at the bounce. */
static bool send(const struct volume_setting *s, struct volume_path *l, enum connection purpose,
                 const float direction[3])
{
    l->purpose = purpose;
    l->n_lookup = 0;
    l->ray = l->bounce;
    volume_ray_turn(s->scene, direction, &l->ray);
    return move_on(s, l, 0);
}

/* Scatters the path at its bounce. False: roulette ends the path. */
static bool scatter(const struct volume_setting *s, struct volume_path *l)
{
    float u[3], wi[3], f_rgb[3], score[VOLUME_N_DERIVATIVE], direction[3], next[3], survival = 1;
    for (int a = 0; a < 3; a++) u[a] = rng_float(&l->rng);
    s->model->sample(s->state, l->wo, l->throughput, u, wi);
    l->pdf = s->model->eval_pdf(s->state, wi, l->wo, l->throughput, f_rgb, s->want_jacobian ? score : NULL);
    if (l->pdf == 0) return false; /* rounded to a direction that has no density */
    for (int c = 0; c < 3; c++) next[c] = l->throughput[c] * f_rgb[c] / l->pdf;
    float most = path_value_largest(next);
    if (!(most > 0)) {
        path_value_keep_nan(l->out->radiance, next);
        return false;
    }
    if (most < s->roulette_below && !path_value_survives(most, s->roulette_below, &l->rng, &survival)) return false;
    for (int c = 0; c < 3; c++) l->throughput[c] = next[c] / survival;
    for (size_t p = 0; s->want_jacobian && p < 3 * s->model->n_param; p++) l->h[p] += score[p];
    note_light(l, VOLUME_SCATTER, wi, (float[3]){1 / (l->pdf * survival), 0, 0});
    fiber_frame_to_world(&l->frame, wi, direction);
    volume_ray_position_mm(s->scene, &l->bounce, l->origin_mm);
    return send(s, l, FLIGHT, direction);
}

/* A direction to the lamp or of the image, its radiance, and its density. False: there is no light that way. */
static bool sample_light(const struct volume_setting *s, struct volume_path *l, enum connection to, float direction[3],
                         float radiance[3], float *pdf)
{
    float u[2] = {rng_float(&l->rng), rng_float(&l->rng)}, position_mm[3];
    if (to == LAMP) {
        volume_ray_position_mm(s->scene, &l->bounce, position_mm);
        if (!lamp_sample(&s->lights.lamp, position_mm, u, direction, pdf)) return false;
        for (int c = 0; c < 3; c++) radiance[c] = lamp_radiance(&s->lights.lamp, direction);
        return true;
    }
    return lights_sample_image(&s->lights, u, direction, radiance, pdf);
}

/* Next-event estimation: a shadow ray to the lamp, then one to the image, then the path is scattered. False: it
 * ends. */
static bool connect(const struct volume_setting *s, struct volume_path *l, enum connection to)
{
    for (; to <= IMAGE; to++) {
        float direction[3], radiance[3], pdf_light, f_rgb[3];
        if (!(to == LAMP ? s->lights.has_lamp : s->lights.image != NULL)) continue;
        if (!sample_light(s, l, to, direction, radiance, &pdf_light)) continue;
        if (direction[2] <= 0 && s->scene->black_sheet) continue;
        fiber_frame_to_local(&l->frame, direction, l->light_wi);
        float pdf = s->model->eval_pdf(s->state, l->light_wi, l->wo, l->throughput, f_rgb, NULL);
        float heuristic = lights_power_heuristic(pdf_light, pdf) / pdf_light;
        for (int c = 0; c < 3; c++) {
            radiance[c] *= heuristic;
            l->light[c] = l->throughput[c] * f_rgb[c] * radiance[c];
        }
        l->light_max = path_value_largest(l->light);
        if (!(l->light_max > 0)) {
            path_value_keep_nan(l->out->radiance, l->light);
            continue;
        }
        l->passed = l->ratios = 1;
        if (l->light_max <
            s->shadow_below) { /* hardly any light: trace few of these shadow rays, with a larger weight each */
            l->passed = s->shadow_below / l->light_max;
            if (rng_float(&l->rng) * l->passed >= 1) continue;
        }
        note_light(l, VOLUME_CONNECT, l->light_wi, radiance);
        l->shadow = (struct flight_score){0, 0};
        return send(s, l, to, direction);
    }
    return scatter(s, l);
}

/* A real collision: the next bounce of the path. */
static bool collide(const struct volume_setting *s, struct volume_path *l, uint32_t voxel,
                    const struct volume_lookup *k)
{
    float tangent[3];
    l->flight.ln_d += 1;
    l->flight.param += k->d_ratio / k->ratio;
    note_lookup(l, VOLUME_REAL, k);
    if (++l->out->n_bounce >= VOLUME_MAX_BOUNCE) return false;
    float back[3] = {-l->ray.direction[0], -l->ray.direction[1], -l->ray.direction[2]};
    volume_voxel_direction(voxel, tangent);
    fiber_frame_from(&l->frame, tangent);
    fiber_frame_to_local(&l->frame, back, l->wo);
    l->bounce = l->ray;
    return connect(s, l, LAMP);
}

/* A tentative collision on the way to a light: ratio tracking. */
static bool pass(const struct volume_setting *s, struct volume_path *l, const struct volume_lookup *k)
{
    float inv = 1 / (1 - k->ratio);
    l->passed *= 1 - k->ratio;
    l->shadow.ln_d -= k->ratio * inv;
    l->shadow.param -= k->d_ratio * inv;
    if (l->record != NULL) l->ratios *= 1 - k->ratio;
    note_lookup(l, VOLUME_PASSED, k);
    float most = l->passed * l->light_max;
    if (most < s->shadow_below) {
        if (rng_float(&l->rng) * s->shadow_below >= most) return connect(s, l, l->purpose + 1);
        l->passed = s->shadow_below / l->light_max;
    }
    return move_on(s, l, 0);
}

/* One read of the brick table or of a voxel. False: the path has ended. */
static inline bool step(const struct volume_setting *s, struct volume_path *l)
{
    if (l->voxel == NULL) {
        int32_t brick = *l->brick;
        if (brick < 0) return move_on(s, l, volume_flight_empty_mm(s->scene, &l->ray, -brick));
        l->voxel = volume_flight_voxel(s->scene, brick, &l->ray);
        __builtin_prefetch(l->voxel);
        return true;
    }
    uint32_t voxel = *l->voxel;
    if (voxel >> 24 == 0) return move_on(s, l, 0);
    struct volume_lookup k = volume_flight_look_up(s->extinction, s->inv_majorant_density, voxel, l->ray.direction);
    if (l->purpose != FLIGHT) return pass(s, l, &k);
    if (rng_float(&l->rng) < k.ratio) return collide(s, l, voxel, &k);
    float inv = 1 / (1 - k.ratio);
    l->flight.ln_d -= k.ratio * inv;
    l->flight.param -= k.d_ratio * inv;
    note_lookup(l, VOLUME_NULL, &k);
    return move_on(s, l, 0);
}

/* False: the path ends at once. */
static bool start(const struct volume_setting *s, struct volume_path *l, const struct volume_ray *ray,
                  const struct rng *rng, struct volume_result *out, struct volume_record *record)
{
    size_t n = s->want_jacobian ? s->model->n_param : 0;
    l->ray = *ray;
    l->rng = *rng;
    l->out = out;
    l->record = record;
    l->purpose = FLIGHT;
    l->n_lookup = 0;
    l->pdf = 0;
    l->flight = (struct flight_score){0, 0};
    volume_ray_position_mm(s->scene, ray, l->origin_mm);
    for (int c = 0; c < 3; c++) l->throughput[c] = 1;
    memset(l->h, 0, 3 * n * sizeof *l->h);
    memset(out->radiance, 0, sizeof out->radiance);
    memset(out->jac, 0, 3 * (n + 1) * sizeof *out->jac);
    out->n_bounce = out->n_lookup = 0;
    return move_on(s, l, 0);
}

void volume_trace(const struct volume_setting *s, struct volume_ray *ray, struct rng *rng, struct volume_result *out,
                  struct volume_record *record)
{
    struct volume_path l;
    if (start(s, &l, ray, rng, out, record))
        while (step(s, &l)) continue;
    *ray = l.ray;
    *rng = l.rng;
}

void volume_trace_many(const struct volume_setting *s, size_t n, struct volume_ray *ray, struct rng *rng,
                       struct volume_result *out)
{
    struct volume_path path[N_AT_ONCE];
    bool busy[N_AT_ONCE] = {false};
    size_t next = 0, n_busy = 0;
    do {
        for (size_t i = 0; i < N_AT_ONCE; i++) {
            if (busy[i]) {
                busy[i] = step(s, &path[i]);
                n_busy -= !busy[i];
            }
            while (!busy[i] && next < n) {
                busy[i] = start(s, &path[i], &ray[next], &rng[next], &out[next], NULL);
                n_busy += busy[i];
                next++;
            }
        }
    } while (n_busy > 0);
}
