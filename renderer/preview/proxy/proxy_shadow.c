/* Soft shadows of the lamp on the cloth itself. */
#include "renderer/preview/proxy/proxy_layers.h"

#include <math.h>
#include <string.h>

struct run {
    const struct proxy_surface *s;
    struct proxy_layers *l;
    struct ray_field field;
};

/* x as the lamp sees it (light_field.h). */
static void lamp_axes(const struct proxy_surface *s, const struct proxy_place *p, const double point[3], double x[2])
{
    const struct lamp *l = &s->lights.lamp;
    double depth = 0.0;
    (void)p;
    x[0] = x[1] = 0.0;
    for (int a = 0; a < 3; a++) {
        const double to = l->distant ? point[a] : point[a] - (double)l->centre_mm[a];
        depth += to * (double)l->normal[a];
        for (int e = 0; e < 2; e++) x[e] += to * (double)l->edge[e][a];
    }
    for (int e = 0; e < 2 && !l->distant; e++) x[e] /= depth;
}

/* Slope of an occluder at a point, for a receiver at a distance from the lamp's plane. */
static double slope_of(const struct proxy_surface *s, const double receiver[3], const double point[3])
{
    const struct lamp *l = &s->lights.lamp;
    double from_receiver = 0.0, depth[2] = {0.0, 0.0};
    for (int a = 0; a < 3; a++) {
        from_receiver -= (point[a] - receiver[a]) * (double)l->normal[a];
        depth[0] += (point[a] - (double)l->centre_mm[a]) * (double)l->normal[a];
        depth[1] += (receiver[a] - (double)l->centre_mm[a]) * (double)l->normal[a];
    }
    return l->distant ? -from_receiver : 1.0 / depth[0] - 1.0 / depth[1];
}

/* Share of the light of y of the lamp that comes. Counts the nearest and the farthest occluder. Where the surface cuts
 * through the lamp, the part on the other side of it than `side`, where the middle is, counts as seen: the appearance
 * has next to no light from there. */
static void look(const struct run *r, const struct proxy_place *p, const double y[2], double side, struct ray_pixel *to,
                 float rgb[3])
{
    const struct proxy_surface *s = r->s;
    double d[3], start[3], end[3], back[3];
    struct scene_proxy_hit hit;
    double share[3], way = 0.0;
    for (int c = 0; c < 3; c++) rgb[c] = 0;
    if (!(proxy_surface_to_lamp(s, p->hit.position_mm, y, d) > 0.0)) return;
    double along = 0.0;
    for (int a = 0; a < 3; a++) along += d[a] * p->facing[a];
    for (int c = 0; c < 3; c++) rgb[c] = 1;
    if (!(side * along > 0.0)) return;
    proxy_surface_start(s, &p->hit, d, start);
    const bool hidden = proxy_surface_layers(s, start, d, &hit, share);
    for (int c = 0; c < 3; c++) rgb[c] = (float)share[c];
    if (!hidden) return;
    ray_pixel_meet(to, (float)slope_of(s, p->hit.position_mm, hit.position_mm));
    for (int a = 0; a < 3; a++) {
        end[a] = s->lights.lamp.distant
                     ? start[a] + 1e4 * d[a]
                     : (double)s->lights.lamp.centre_mm[a] + y[0] * (double)s->lights.lamp.edge[0][a] +
                           y[1] * (double)s->lights.lamp.edge[1][a];
        back[a] = -d[a];
        way += (end[a] - hit.position_mm[a]) * d[a];
    }
    if (scene_proxy_trace(s->q->scene, end, back, 0.0, &hit) && hit.distance_mm < way + s->clear_mm)
        ray_pixel_meet(to, (float)slope_of(s, p->hit.position_mm, hit.position_mm));
}

static void sample_pixel(void *context, size_t i)
{
    struct run *r = context;
    struct ray_field *f = &r->field;
    const struct proxy_place *p = &r->l->place[i];
    struct ray_pixel *to = &f->pixel[i];
    struct rng rng;
    double middle[3], side = 0.0;
    *to = r->l->receiver[i];
    if (!to->used) return;
    proxy_surface_to_lamp(r->s, p->hit.position_mm, (const double[2]){0.0, 0.0}, middle);
    for (int a = 0; a < 3; a++) side += middle[a] * p->facing[a];
    side = side > 0.0 ? 1.0 : -1.0;
    /* places that are lit from behind are no neighbours of others */
    for (int a = 0; a < 3; a++) to->normal[a] *= (float)side;
    if (!proxy_layers_receiver(r->s, p, i, lamp_axes, to)) to->depth_mm = -1, to->cell[0] = to->cell[1] = 1;
    proxy_surface_random(r->s, i, 0, &rng);
    for (int a = 0; a < 2; a++) to->jitter[a] = (float)rng_double(&rng);
    for (size_t j2 = 0; j2 < f->n_side; j2++)
        for (size_t j1 = 0; j1 < f->n_side; j1++) {
            const double y[2] = {(double)ray_field_y(f, to, 0, j1), (double)ray_field_y(f, to, 1, j2)};
            look(r, p, y, side, to, ray_field_value(f, i, j1, j2));
        }
}

status proxy_shadow_make(const struct proxy_surface *s, struct thread_pool *pool, const struct progress *progress,
                         struct proxy_layers *l, struct error *err)
{
    const struct lamp *lamp = &s->lights.lamp;
    const size_t n = s->q->width * s->q->height;
    struct run r = {.s = s, .l = l};
    for (size_t i = 0; i < 3 * n; i++) l->visible[i] = 1;
    if (!s->lights.has_lamp) return STATUS_OK;
    status st = ray_field_init(&r.field, s->q->width, s->q->height, lamp->directional ? 1 : s->q->n_side, 3, err);
    r.field.window = lamp->distant ? RAY_GAUSSIAN : RAY_SQUARE;
    r.field.half = lamp->directional ? 1e-6f : lamp->distant ? 2 / sqrtf(lamp->sharpness) : lamp->half_side_mm;
    const struct proxy_rays rays = {&r.field, lamp->directional ? RAY_OWN : s->q->way, sample_pixel, &r};
    if (st == STATUS_OK) st = proxy_rays_filter(&rays, pool, progress, l->visible, err);
    ray_field_release(&r.field);
    return st;
}
