/* A walk from bounce to bounce. This file is compiled twice: for all settings (path_tracer.c), and with PATH_PLAIN 1
 * for plain settings (path_setting.plain; path_plain.c), whose walks then contain no tests for rare parts. */
#ifndef SELVEDGE_RENDERER_PATH_STEPS_H
#define SELVEDGE_RENDERER_PATH_STEPS_H

#include "renderer/scene/scene_glint.h"
#include "renderer/transport/path_value.h"
#include "renderer/transport/surface/path_connect.h"

#include <math.h>
#include <string.h>

#define GUIDED_PATH_SCALE 1.5f

/* Adds the radiance that a ray meets when it has left the cloth. pdf: density of the scattering sample that made the
 * ray; 0 for a camera ray. */
static void add_beyond(struct walk *w, const struct scene_ray *ray, float pdf)
{
    const struct path_setting *s = w->s;
    if (scene_sheet_met(s->scene, ray) || (pdf == 0 && s->lights.unseen)) return;
    float around[3] = {0, 0, 0}, position[3];
    lights_add_environment(&s->lights, ray->direction, pdf, around);
    unwrapped(ray->origin_mm, ray->offset_mm, position);
    for (size_t i = 0; i < w->n_out; i++) {
        float beyond[3], value[3], over = pdf;
        if (pdf > 0 && i < w->n_lamp && w->has_strips && w->strip[i].used)
            over /= 1 + lamp_strip_ratio_towards(&w->strip[i], &w->lamp[i], position, ray->direction);
        float lamp = i < w->n_lamp ? lights_lamp_beyond(&w->lamp[i], position, ray->direction, over) : 0;
        for (int c = 0; c < 3; c++) {
            beyond[c] = lamp + around[c];
            value[c] = w->throughput[c] * beyond[c];
        }
        w->out = w->first_out + i;
        path_factor_apply(w, NULL, ray->direction, value);
        if (value[0] + value[1] + value[2] > 0) path_add_light(w, value, NULL);
        if (path_walk_recorded(w)) memcpy(w->step->escape, beyond, sizeof beyond);
    }
}

static inline void add_scores(struct walk *w)
{
    const size_t n = w->s->model->n_param, n_set = w->s->n_set;
    float *h = w->h;
    if (PATH_PLAIN || n_set == 1) { /* h and score have the same layout */
        for (size_t i = 0; i < 3 * n; i++) h[i] += w->score[i];
        return;
    }
    for (size_t c = 0; c < 3; c++)
        for (size_t p = 0; p < n; p++) h[(c * n_set + w->i_set) * n + p] += w->score[c * n + p];
}

/* Fills in the rest of a bounce whose hit is known. */
static void bounce_at(struct walk *w, const struct scene_ray *ray, struct bounce *b)
{
    const float back[3] = {-ray->direction[0], -ray->direction[1], -ray->direction[2]};
    const struct scene_hit *hit = &b->hit;
    b->has_speckle = false;
    memcpy(b->offset_mm, ray->offset_mm, sizeof b->offset_mm);
    unwrapped(hit->position_mm, b->offset_mm, b->position_mm);
    if (!PATH_PLAIN) b->glint.surface = NULL;
    if (!PATH_PLAIN && w->s->has_films) w->film = scene_film(w->s->scene, hit->i_segment);
    const bool flat = !PATH_PLAIN && (w->s->model->flat_section || w->film != NULL);
    float section[3];
    const bool bent = (flat || path_factor_wanted(w->s)) && scene_bent_normal(w->s->scene, hit, b->normal);
    if (!PATH_PLAIN && w->s->model->near_field && w->film == NULL)
        fiber_frame_flat_in(&b->frame, hit->tangent, hit->normal);
    else if (!flat)
        fiber_frame_from(&b->frame, hit->tangent);
    else if (scene_section_normal(w->s->scene, hit, section))
        fiber_frame_flat_in(&b->frame, hit->tangent, section);
    else if (bent)
        fiber_frame_flat_in(&b->frame, hit->tangent, b->normal);
    else
        fiber_frame_flat(&b->frame, hit->tangent);
    if (!PATH_PLAIN && !bent) memcpy(b->normal, (const float[3]){0, 0, 1}, sizeof b->normal);
    fiber_frame_to_local(&b->frame, back, b->wo);
    if (!PATH_PLAIN && w->s->n_set > 1 && w->film == NULL) {
        w->i_set = scene_group_of(w->s->scene, hit->i_segment);
        w->state = w->s->state[w->i_set];
    }
    path_scatter_look(w, b);
}

/* At the first hit the camera sees the facets of a film one by one. Later hits see their mean: light that a rough
 * fiber or film has scattered covers many of them. */
static void see_glints(const struct walk *w, struct bounce *b)
{
    float place_um[2];
    b->glint.surface = scene_glint_at(w->s->scene, &b->hit, b->offset_mm, place_um);
    b->glint.waves = scene_glint_waves(w->s->scene, &b->hit);
    if (b->glint.surface != NULL) film_glint_see(&b->glint, place_um, w->s->pixel_um, b->wo);
}

/* The part of a guided path beyond the present bounce. The walk carries its throughput and scores meanwhile. */
static void follow_guided_path(struct walk *w, size_t i_lamp, const struct bounce *from, const float direction[3],
                               float weight)
{
    struct scene_ray ray;
    struct bounce b;
    struct lamp_strip strip;
    float wi[3];
    path_leave(w, from, direction, &ray);
    if (!scene_trace(w->s->scene, &ray, &b.hit)) return; /* light beyond the cloth is counted by the walk itself */
    bounce_at(w, &ray, &b);
    float light = path_connect_lamp(w, &w->lamp[i_lamp], 1, &b, &strip, wi);
    if (!path_walk_recorded(w) || light == 0) return;
    memcpy(w->step->guided_wo, b.wo, sizeof b.wo);
    memcpy(w->step->guided_light_wi, wi, sizeof wi);
    w->step->guided_light = light * weight;
    w->step->i_guided_group = scene_group_of(w->s->scene, b.hit.i_segment);
}

/* A guided shadow path reaches a lamp by way of one other fiber: a ray is drawn near the direction of the lamp
 * (light_guide.h), connects its hit with the lamp, and ends. The walk can find the same light by a scattering
 * sample followed by a connection; the balance heuristic combines the two, and walk.weight is the weight of the walk's
 * own. The walk itself does not turn towards the lamp, because its later contributions would then carry a smaller
 * weight. */
static void trace_guided_path(struct walk *w, size_t i_lamp, const struct bounce *b)
{
    const struct path_setting *s = w->s;
    float u[2], direction[3], wi[3], s_rgb[3], next[3], survival;
    u[0] = rng_float(w->rng);
    u[1] = rng_float(w->rng);
    light_guide_sample(w->towards[i_lamp], u, direction);
    fiber_frame_to_local(&b->frame, direction, wi);
    float pdf = path_scatter(w, b, wi, s_rgb, NULL);
    float weight = fiber_frame_cos_theta(wi) / (pdf + w->p_guided * light_guide_pdf(w->towards[i_lamp], direction));
    for (int c = 0; c < 3; c++) next[c] = w->throughput[c] * s_rgb[c] * weight;
    float most = path_value_largest(next);
    if (!(most > 0)) {
        path_value_keep_nan(w->out->radiance, next);
        return;
    }
    if (most < PATH_SURFACE_GUIDED_BELOW) {
        if (!path_value_survives(most, PATH_SURFACE_GUIDED_BELOW, w->rng, &survival)) return;
        weight /= survival;
        for (int c = 0; c < 3; c++) next[c] /= survival;
    }
    size_t n_flat = s->want_jacobian ? 3 * s->n_set * s->model->n_param : 0, i_set = w->i_set;
    const struct scattering_state *state = w->state;
    const struct film_material *film = w->film;
    float throughput[3], h[PATH_N_DERIVATIVE];
    memcpy(throughput, w->throughput, sizeof throughput);
    memcpy(h, w->h, n_flat * sizeof *h);
    path_scatter_score(w, b, wi);
    memcpy(w->throughput, next, sizeof next);
    w->h = h;
    if (s->want_jacobian) add_scores(w);
    if (path_walk_recorded(w)) memcpy(w->step->guided_wi, wi, sizeof wi);
    follow_guided_path(w, i_lamp, b, direction, weight);
    w->state = state;
    w->film = film;
    w->i_set = i_set;
    w->h = w->h_walk;
    memcpy(w->throughput, throughput, sizeof throughput);
}

/* Proportional to the share of light that a fiber of this kind scatters forwards. */
static float guided_path_probability(const struct walk *w)
{
    const struct light_guide_energy *e = &w->s->energy[w->i_set];
    if (path_walk_on_film(w)) return 0; /* nothing goes through it */
    float forward = 0, all = 0;
    for (int c = 0; c < 3; c++) {
        forward += w->throughput[c] * e->forward[c];
        all += w->throughput[c] * e->all[c];
    }
    float p = GUIDED_PATH_SCALE * forward / all;
    return p < 1 ? p : 1;
}

static void guide_to_lamp(struct walk *w, size_t i_lamp, const struct bounce *b)
{
    light_guide_towards(&w->lamp[i_lamp], b->position_mm, w->towards[i_lamp]);
    bool sees = !path_walk_hides(w, w->towards[i_lamp]);
    if (sees && (w->p_guided >= 1 || rng_float(w->rng) < w->p_guided)) trace_guided_path(w, i_lamp, b);
}

/* Adds the light of all lamps at a bounce, by a direct connection and by a guided path. */
static void connect_lamps(struct walk *w, const struct bounce *b)
{
    float wi[3];
    if (w->s->guided_paths) w->p_guided = guided_path_probability(w);
    for (size_t k = 0; k < w->n_lamp; k++) {
        w->out = w->first_out + k;
        float light = path_connect_lamp(w, &w->lamp[k], w->weight[k], b, &w->strip[k], wi);
        if (path_walk_recorded(w) && light != 0) {
            memcpy(w->step->light_wi, wi, sizeof wi);
            w->step->light = light;
        }
        if (w->s->guided_paths && (PATH_PLAIN || !w->last)) guide_to_lamp(w, k, b);
    }
}

/* Scatters the path at a bounce into ray. False: roulette or a dark fiber ends the path. */
static bool scatter(struct walk *w, const struct bounce *b, struct scene_ray *ray, float *pdf_out)
{
    const struct path_setting *s = w->s;
    float u[3], wi[3], s_rgb[3], direction[3], survival = 1;
    for (int a = 0; a < 3; a++) u[a] = rng_float(w->rng);
    path_scatter_sample(w, b, u, wi);
    float pdf = path_scatter(w, b, wi, s_rgb, s->want_jacobian ? w->score : NULL);
    if (pdf == 0) return false; /* rounding gave a direction along the fiber, into which nothing is scattered */
    float weight = fiber_frame_cos_theta(wi) / pdf, next[3];
    for (int c = 0; c < 3; c++) next[c] = w->throughput[c] * s_rgb[c] * weight;
    float most = path_value_largest(next);
    if (!(most > 0)) {
        path_value_keep_nan(w->out->radiance, next);
        return false;
    }
    if (most < s->roulette_below && !path_value_survives(most, s->roulette_below, w->rng, &survival)) return false;
    for (int c = 0; c < 3; c++) w->throughput[c] = next[c] / survival;
    if (s->want_jacobian) add_scores(w);
    if (path_walk_recorded(w)) {
        memcpy(w->step->wi, wi, sizeof wi);
        w->step->weight = weight / survival;
    }
    fiber_frame_to_world(&b->frame, wi, direction);
    for (size_t k = 0; k < w->n_lamp && s->guided_paths; k++)
        w->weight[k] = pdf / (pdf + w->p_guided * light_guide_pdf(w->towards[k], direction));
    path_leave(w, b, direction, ray);
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

/* The last bounce of a setting with n_traced. The direct connection has taken all of the lamp's light only if nothing
 * else could find it; otherwise a ray looks for the rest. */
static void end_beyond_last(struct walk *w, struct bounce *b, struct scene_ray *ray)
{
    const struct path_setting *s = w->s;
    float rgb[3] = {0, 0, 0}, value[3], pdf;
    if (s->finish != NULL) s->finish(s->finish_context, &b->hit, ray, w->rng, rgb);
    for (int c = 0; c < 3; c++) value[c] = w->throughput[c] * rgb[c];
    path_add_light_to_all(w, value, NULL);
    if (path_walk_connects_all(w)) return;
    if (scatter(w, b, ray, &pdf) && !scene_trace(s->scene, ray, &(struct scene_hit){0})) add_beyond(w, ray, pdf);
}

/* Traces the walk from bounce to bounce until it leaves the cloth or ends. */
static void walk_on(struct walk *w, struct scene_ray *ray, struct path_record *record)
{
    const struct path_setting *s = w->s;
    float pdf = 0;
    for (uint32_t i = 0; i < PATH_MAX_BOUNCE; i++) {
        struct bounce b;
        if (!scene_trace(s->scene, ray, &b.hit)) {
            add_beyond(w, ray, pdf);
            return;
        }
        w->last = !PATH_PLAIN && i + 1 == s->n_traced;
        w->first_out->n_bounce++;
        if (!PATH_PLAIN) w->step = next_step(record);
        bounce_at(w, ray, &b);
        if (!PATH_PLAIN && i == 0 && w->film != NULL && s->pixel_um > 0 && record == NULL) see_glints(w, &b);
        if (path_factor_wanted(s)) path_factor_note(w, &b, ray);
        if (path_walk_recorded(w)) {
            memcpy(w->step->wo, b.wo, sizeof b.wo);
            w->step->i_group = scene_group_of(s->scene, b.hit.i_segment);
        }
        float rgb[3] = {0, 0, 0};
        if (!PATH_PLAIN && i == 0 && s->begin != NULL) {
            s->begin(s->finish_context, &b.hit, ray, w->rng, rgb);
            path_add_light_to_all(w, rgb, NULL);
        }
        connect_lamps(w, &b);
        if (!PATH_PLAIN && s->lights.image != NULL) path_connect_image(w, &b);
        if (!PATH_PLAIN && w->last) {
            end_beyond_last(w, &b, ray);
            return;
        }
        if (!scatter(w, &b, ray, &pdf)) return;
    }
}

#endif
