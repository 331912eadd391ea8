#include "renderer/transport/volume/volume_bent.h"

#include "renderer/transport/path_value.h"
#include "renderer/transport/volume/volume_flight.h"

#include <math.h>
#include <string.h>

enum { MOST_LOOKUP = 200000 };

struct bent_path {
    const struct volume_setting *s;
    struct rng *rng;
    struct volume_result *out;
    struct shell_walk walk;
    struct volume_ray flat; /* at walk.t, its direction of length 1 in the flat cloth */
    double stretch;         /* length in the flat cloth of a millimetre along the walk */
    uint32_t voxel;
    struct volume_lookup seen;
    struct fiber_frame frame;
    float wo[3], throughput[3];
};

static void start_walk(struct bent_path *p, const double origin[3], const double direction[3], uint32_t i_cell)
{
    p->walk = (struct shell_walk){
        .space = &p->s->scene->bent->space, .black_sheet = p->s->scene->black_sheet, .i_cell = i_cell, .from_face = -1};
    memcpy(p->walk.origin, origin, sizeof p->walk.origin);
    memcpy(p->walk.direction, direction, sizeof p->walk.direction);
}

/* The place in the flat cloth. False above and below the slab. */
static bool take_place(struct bent_path *p)
{
    const struct volume_scene *v = p->s->scene;
    double at[3], d[3];
    float unit[3];
    shell_walk_flat(&p->walk, at, d);
    p->stretch = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int a = 0; a < 3; a++) {
        double x = at[a] / (double)v->voxel_mm[a];
        if (a < 2) {
            x -= floor(x / (double)v->n_voxel[a]) * (double)v->n_voxel[a];
            if (!(x < (double)v->n_voxel[a])) x = 0.0;
        }
        p->flat.at[a] = (float)(a < 2 ? x : x + (double)v->high);
        unit[a] = (float)(d[a] / p->stretch);
    }
    for (int a = 0; a < 2; a++)
        if (!(p->flat.at[a] < v->n_voxel[a])) p->flat.at[a] = 0.0f;
    volume_ray_turn(v, unit, &p->flat);
    return p->flat.at[2] >= v->low && p->flat.at[2] < v->high;
}

/* Goes on to the next tentative collision, or to the end of its cell. True: at one, in a voxel that holds something. */
static bool step(struct bent_path *p)
{
    const struct volume_scene *v = p->s->scene;
    int face;
    double end = shell_walk_exit(&p->walk, &face), by;
    bool inside = take_place(p);
    const int32_t *brick = inside ? volume_flight_brick(v, &p->flat) : NULL;
    if (brick != NULL && *brick < 0)
        by = (double)volume_flight_empty_mm(v, &p->flat, -*brick) / p->stretch + SHELL_OVERLAP_MM;
    else
        by = (double)(volume_flight_minus_log(rng_float(p->rng)) * p->s->mean_step_mm) / p->stretch;
    p->out->n_lookup++;
    if (p->walk.t + by >= end) {
        shell_walk_on(&p->walk, end, face);
        return false;
    }
    p->walk.t += by;
    if ((brick != NULL && *brick < 0) || !take_place(p)) return false;
    brick = volume_flight_brick(v, &p->flat);
    p->voxel = *brick < 0 ? 0 : *volume_flight_voxel(v, *brick, &p->flat);
    if (p->voxel >> 24 == 0) return false;
    p->seen = volume_flight_look_up(p->s->extinction, p->s->inv_majorant_density, p->voxel, p->flat.direction);
    return true;
}

/* To the next real collision. False: the path has left the cloth, has ended on the sheet, or is lost. */
static bool fly(struct bent_path *p)
{
    for (int i = 0; i < MOST_LOOKUP; i++) {
        if (p->walk.i_cell == SHELL_OUTSIDE && !shell_walk_enter(&p->walk)) return false;
        if (p->walk.i_cell == SHELL_ON_SHEET) return false;
        if (step(p) && rng_float(p->rng) < p->seen.ratio) return true;
    }
    p->walk.i_cell = SHELL_ON_SHEET;
    return false;
}

/* Share of the light that comes through from beyond the cloth, by ratio tracking; small ones are ended at random. */
static float transmittance(struct bent_path *p, float light_max)
{
    float passed = 1.0f;
    for (int i = 0; i < MOST_LOOKUP; i++) {
        if (p->walk.i_cell == SHELL_OUTSIDE && !shell_walk_enter(&p->walk))
            return p->walk.i_cell == SHELL_ON_SHEET ? 0.0f : passed;
        if (p->walk.i_cell == SHELL_ON_SHEET) return 0.0f;
        if (!step(p)) continue;
        passed *= 1.0f - p->seen.ratio;
        float most = passed * light_max;
        if (most >= p->s->shadow_below) continue;
        if (rng_float(p->rng) * p->s->shadow_below >= most) return 0.0f;
        passed = p->s->shadow_below / light_max;
    }
    return 0.0f;
}

/* Next-event estimation: the light of one direction. */
static void connect(struct bent_path *p, const double position[3], const float direction[3], const float radiance[3],
                    float pdf_light)
{
    const struct volume_setting *s = p->s;
    float wi[3], f_rgb[3], light[3];
    fiber_frame_to_local(&p->frame, direction, wi);
    float pdf = s->model->eval_pdf(s->state, wi, p->wo, p->throughput, f_rgb, NULL);
    float heuristic = lights_power_heuristic(pdf_light, pdf) / pdf_light;
    for (int c = 0; c < 3; c++) light[c] = p->throughput[c] * f_rgb[c] * radiance[c] * heuristic;
    float most = path_value_largest(light);
    if (!(most > 0)) {
        path_value_keep_nan(p->out->radiance, light);
        return;
    }
    const struct shell_walk kept = p->walk;
    const double d[3] = {(double)direction[0], (double)direction[1], (double)direction[2]};
    start_walk(p, position, d, kept.i_cell);
    float passed = transmittance(p, most);
    for (int c = 0; c < 3; c++) p->out->radiance[c] += light[c] * passed;
    p->walk = kept;
}

static void connect_lights(struct bent_path *p, const double position[3])
{
    const struct lights *l = &p->s->lights;
    float u[2] = {rng_float(p->rng), rng_float(p->rng)}, direction[3], radiance[3], pdf;
    if (l->has_lamp) {
        const float at[3] = {(float)position[0], (float)position[1], (float)position[2]};
        if (lamp_sample(&l->lamp, at, u, direction, &pdf)) {
            for (int c = 0; c < 3; c++) radiance[c] = lamp_radiance(&l->lamp, direction);
            connect(p, position, direction, radiance, pdf);
        }
    }
    if (l->image == NULL) return;
    u[0] = rng_float(p->rng);
    u[1] = rng_float(p->rng);
    if (lights_sample_image(l, u, direction, radiance, &pdf)) connect(p, position, direction, radiance, pdf);
}

/* Adds the light that a path meets after it has left the cloth. pdf: as lights_lamp_beyond. */
static void add_beyond(struct bent_path *p, float pdf)
{
    if (p->walk.i_cell == SHELL_ON_SHEET || (pdf == 0 && p->s->lights.unseen)) return;
    float direction[3], from[3], beyond[3] = {0, 0, 0};
    for (int a = 0; a < 3; a++) {
        direction[a] = (float)p->walk.direction[a];
        from[a] = (float)p->walk.origin[a];
    }
    if (p->s->lights.has_lamp) {
        float lamp = lights_lamp_beyond(&p->s->lights.lamp, from, direction, pdf);
        for (int c = 0; c < 3; c++) beyond[c] = lamp;
    }
    lights_add_environment(&p->s->lights, direction, pdf, beyond);
    for (int c = 0; c < 3; c++) p->out->radiance[c] += p->throughput[c] * beyond[c];
}

/* The fiber frame of the voxel, as it lies in the bent cloth. */
static void take_frame(struct bent_path *p)
{
    const struct shell_cell *c = &p->walk.space->shell.cell[p->walk.i_cell];
    float along[3], tangent[3], back[3], length2 = 0;
    volume_voxel_direction(p->voxel, along);
    for (int a = 0; a < 3; a++) {
        tangent[a] = fiber_frame_dot(c->to_world[a], along);
        length2 += tangent[a] * tangent[a];
        back[a] = (float)-p->walk.direction[a];
    }
    for (int a = 0; a < 3; a++) tangent[a] /= sqrtf(length2);
    fiber_frame_from(&p->frame, tangent);
    fiber_frame_to_local(&p->frame, back, p->wo);
}

/* Scatters the path at a place. 0: it ends; otherwise the density of the new direction. */
static float scatter(struct bent_path *p, const double position[3])
{
    const struct volume_setting *s = p->s;
    float u[3], wi[3], f_rgb[3], next[3], direction[3], survival = 1;
    for (int a = 0; a < 3; a++) u[a] = rng_float(p->rng);
    s->model->sample(s->state, p->wo, p->throughput, u, wi);
    float pdf = s->model->eval_pdf(s->state, wi, p->wo, p->throughput, f_rgb, NULL);
    if (pdf == 0) return 0;
    for (int c = 0; c < 3; c++) next[c] = p->throughput[c] * f_rgb[c] / pdf;
    float most = path_value_largest(next);
    if (!(most > 0)) {
        path_value_keep_nan(p->out->radiance, next);
        return 0;
    }
    if (most < s->roulette_below && !path_value_survives(most, s->roulette_below, p->rng, &survival)) return 0;
    for (int c = 0; c < 3; c++) p->throughput[c] = next[c] / survival;
    fiber_frame_to_world(&p->frame, wi, direction);
    const double d[3] = {(double)direction[0], (double)direction[1], (double)direction[2]};
    start_walk(p, position, d, p->walk.i_cell);
    return pdf;
}

void volume_bent_trace(const struct volume_setting *s, const double origin_mm[3], const double direction[3],
                       struct rng *rng, struct volume_result *out)
{
    struct bent_path p = {.s = s, .rng = rng, .out = out, .throughput = {1, 1, 1}};
    float pdf = 0;
    memset(out->radiance, 0, sizeof out->radiance);
    out->n_bounce = out->n_lookup = 0;
    start_walk(&p, origin_mm, direction, SHELL_OUTSIDE);
    while (fly(&p)) {
        double position[3];
        if (++out->n_bounce >= VOLUME_MAX_BOUNCE) return;
        shell_walk_point(&p.walk, p.walk.t, position);
        take_frame(&p);
        connect_lights(&p, position);
        pdf = scatter(&p, position);
        if (pdf == 0) return;
    }
    add_beyond(&p, pdf);
}
