/* Soft shadows of the lamp on the cloth itself. */
#include "renderer/preview/proxy/proxy_layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Places on the lamp along an edge by which its two sides are weighed. */
enum { SIDE_PLACES = 4 };

/* Where the plane of the surface cuts through the lamp, the side that sends less light to the camera: its share of that
 * light, and how much of it comes. */
struct lamp_side {
    float share, seen[3];
};

struct run {
    const struct proxy_surface *s;
    struct proxy_layers *l;
    struct ray_field field;
    struct lamp_side *lesser; /* of each pixel */
};

/* x as the lamp sees it (ray_field.h). */
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

/* A ray to y of the lamp. */
struct lamp_ray {
    double y[2], direction[3];
    bool above;    /* it leaves on the side of the camera */
    double weight; /* its part in the light that a matte cloth sends to the camera; 0: behind the lamp */
};

static struct lamp_ray aim(const struct run *r, const struct proxy_place *p, double y_first, double y_second)
{
    const struct proxy_surface *s = r->s;
    const double half = (double)r->field.half, far2 = (y_first * y_first + y_second * y_second) / (half * half);
    struct lamp_ray ray = {.y = {y_first, y_second}};
    double along = 0.0, share = 0.0;
    if (!(proxy_surface_to_lamp(s, p->hit.position_mm, ray.y, ray.direction) > 0.0)) return ray;
    for (int a = 0; a < 3; a++) along += ray.direction[a] * p->facing[a];
    ray.above = along > 0.0;
    for (int c = 0; c < 3; c++) share += ray.above ? s->albedo[p->hit.lower][c] : s->through[c];
    ray.weight = share * fabs(along) * (r->field.window == RAY_GAUSSIAN ? exp(-2.0 * far2) : 1.0);
    return ray;
}

/* Share of the light that comes along a ray. Counts the slopes of the nearest and the farthest occluder; to NULL: does
 * not. */
static void look(const struct run *r, const struct proxy_place *p, const struct lamp_ray *ray, struct ray_pixel *to,
                 double share[3])
{
    const struct proxy_surface *s = r->s;
    const double *d = ray->direction;
    double start[3], end[3], back[3], way = 0.0;
    struct scene_proxy_hit hit;
    proxy_surface_start(s, &p->hit, d, start);
    if (!proxy_surface_layers(s, start, d, &hit, share) || to == NULL) return;
    ray_pixel_meet(to, (float)slope_of(s, p->hit.position_mm, hit.position_mm));
    for (int a = 0; a < 3; a++) {
        end[a] = s->lights.lamp.distant
                     ? start[a] + 1e4 * d[a]
                     : (double)s->lights.lamp.centre_mm[a] + ray->y[0] * (double)s->lights.lamp.edge[0][a] +
                           ray->y[1] * (double)s->lights.lamp.edge[1][a];
        back[a] = -d[a];
        way += (end[a] - hit.position_mm[a]) * d[a];
    }
    if (scene_proxy_trace(s->q->scene, end, back, 0.0, &hit) && hit.distance_mm < way + s->clear_mm)
        ray_pixel_meet(to, (float)slope_of(s, p->hit.position_mm, hit.position_mm));
}

/* Weighs the two sides of the lamp, and looks at the lesser one. Returns whether the greater one is above. */
static bool weigh_sides(struct run *r, size_t i)
{
    const struct proxy_place *p = &r->l->place[i];
    struct lamp_side *lesser = &r->lesser[i];
    struct lamp_ray ray[SIDE_PLACES * SIDE_PLACES];
    double weight[2] = {0.0, 0.0}, seen[3] = {0.0, 0.0, 0.0}, share[3];
    for (int j = 0; j < SIDE_PLACES * SIDE_PLACES; j++) {
        const double half = (double)r->field.half;
        ray[j] = aim(r, p, half * ((j % SIDE_PLACES + 0.5) * 2 / SIDE_PLACES - 1),
                     half * ((j / SIDE_PLACES + 0.5) * 2 / SIDE_PLACES - 1));
        weight[ray[j].above] += ray[j].weight;
    }
    const bool above = weight[1] >= weight[0];
    if (!(weight[!above] > 0.0)) return above;
    for (int j = 0; j < SIDE_PLACES * SIDE_PLACES; j++) {
        if (ray[j].above == above || !(ray[j].weight > 0.0)) continue;
        look(r, p, &ray[j], NULL, share);
        for (int c = 0; c < 3; c++) seen[c] += share[c] * ray[j].weight;
    }
    lesser->share = (float)(weight[!above] / (weight[0] + weight[1]));
    for (int c = 0; c < 3; c++) lesser->seen[c] = (float)(seen[c] / weight[!above]);
    return above;
}

/* The rays of the greater side of the lamp; others get their mean. Pixels of another side are no neighbours. */
static void sample_pixel(void *context, size_t i)
{
    struct run *r = context;
    struct ray_field *f = &r->field;
    const struct proxy_place *p = &r->l->place[i];
    struct ray_pixel *to = &f->pixel[i];
    bool is_other[RAY_MAX_SIDE * RAY_MAX_SIDE] = {false};
    struct rng rng;
    float sum[3] = {0, 0, 0}, n = 0;
    *to = r->l->receiver[i];
    if (!to->used) return;
    const bool above = weigh_sides(r, i);
    for (int a = 0; a < 3 && !above; a++) to->normal[a] *= -1;
    if (!proxy_layers_receiver(r->s, p, i, lamp_axes, to)) to->depth_mm = -1, to->cell[0] = to->cell[1] = 1;
    proxy_surface_random(r->s, i, 0, &rng);
    for (int a = 0; a < 2; a++) to->jitter[a] = (float)rng_double(&rng);
    for (size_t j = 0; j < f->n_side * f->n_side; j++) {
        const struct lamp_ray ray =
            aim(r, p, (double)ray_field_y(f, to, 0, j % f->n_side), (double)ray_field_y(f, to, 1, j / f->n_side));
        float *value = ray_field_value(f, i, j % f->n_side, j / f->n_side);
        double share[3];
        is_other[j] = ray.weight > 0.0 && ray.above != above;
        if (!(ray.weight > 0.0) || is_other[j]) continue;
        look(r, p, &ray, to, share);
        for (int c = 0; c < 3; c++) sum[c] += value[c] = (float)share[c];
        n++;
    }
    for (size_t j = 0; j < f->n_side * f->n_side; j++)
        for (size_t c = 0; c < 3 && is_other[j]; c++)
            ray_field_value(f, i, j % f->n_side, j / f->n_side)[c] = n > 0 ? sum[c] / n : 1;
}

static void join_sides(const struct run *r, size_t n_pixel)
{
    for (size_t i = 0; i < n_pixel; i++)
        for (size_t c = 0; c < 3; c++) {
            const struct lamp_side *lesser = &r->lesser[i];
            float *visible = &r->l->visible[3 * i + c];
            *visible += lesser->share * (lesser->seen[c] - *visible);
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
    r.lesser = calloc(n, sizeof *r.lesser);
    if (st == STATUS_OK && r.lesser == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot make a preview: out of memory");
    if (st == STATUS_OK) st = proxy_rays_filter(&rays, pool, progress, l->visible, err);
    if (st == STATUS_OK) join_sides(&r, n);
    free(r.lesser);
    ray_field_release(&r.field);
    return st;
}
