/* Light that other folds of the cloth send once, and light of the environment, on the cloth. */
#include "renderer/preview/proxy/proxy_layers.h"

#include <math.h>
#include <string.h>

struct run {
    const struct proxy_surface *s;
    struct proxy_layers *l;
    struct ray_field field;
};

/* Radiance that comes to a place from a direction. *height: of the place that sends it, above the receiver's plane; 0:
 * the environment sends it. */
static void look(const struct proxy_surface *s, const struct proxy_place *p, const double d[3], struct rng *rng,
                 float rgb[3], double *height)
{
    double start[3], normal[3], to_lamp[3], layers[3], cosine = 0.0;
    struct scene_proxy_hit hit, unused;
    proxy_surface_start(s, &p->hit, d, start);
    *height = 0.0;
    rgb[0] = rgb[1] = rgb[2] = 0;
    if (!scene_proxy_trace(s->q->scene, start, d, s->clear_mm, &hit)) {
        const float direction[3] = {(float)d[0], (float)d[1], (float)d[2]};
        lights_add_environment(&s->lights, direction, 0, rgb);
        return;
    }
    for (int a = 0; a < 3; a++) *height += (hit.position_mm[a] - p->hit.position_mm[a]) * p->facing[a];
    if (!s->lights.has_lamp) return;
    const double side = hit.lower ? -1.0 : 1.0, half = s->lights.lamp.distant
                                                           ? 1.0 / sqrt(fmax((double)s->lights.lamp.sharpness, 1.0))
                                                           : (double)s->lights.lamp.half_side_mm;
    const double y[2] = {(2.0 * rng_double(rng) - 1.0) * half, (2.0 * rng_double(rng) - 1.0) * half};
    const double none[2] = {0.0, 0.0};
    if (!(proxy_surface_to_lamp(s, hit.position_mm, s->lights.lamp.directional ? none : y, to_lamp) > 0.0)) return;
    for (int a = 0; a < 3; a++) {
        normal[a] = side * hit.normal[a];
        cosine += normal[a] * to_lamp[a];
    }
    proxy_surface_start(s, &hit, to_lamp, start);
    proxy_surface_layers(s, start, to_lamp, &unused, layers);
    const double *share = cosine > 0.0 ? s->albedo[hit.lower] : s->through;
    for (int a = 0; a < 3 && cosine < 0.0; a++) normal[a] = -normal[a];
    const double light = proxy_surface_light(s, hit.position_mm, normal);
    for (int c = 0; c < 3; c++) rgb[c] = (float)(share[c] * light * layers[c]);
}

/* x along two directions of the surface that change slowly from pixel to pixel. */
static void surface_axes(const struct proxy_surface *s, const struct proxy_place *p, double axis[2][3])
{
    double along = 0.0, length = 0.0;
    for (int a = 0; a < 3; a++) along += s->camera.right_mm[a] * p->facing[a];
    for (int a = 0; a < 3; a++) {
        axis[0][a] = s->camera.right_mm[a] - along * p->facing[a];
        length += axis[0][a] * axis[0][a];
    }
    for (int a = 0; a < 3; a++) axis[0][a] /= sqrt(length) + 1e-30;
    for (int a = 0; a < 3; a++)
        axis[1][a] = p->facing[(a + 1) % 3] * axis[0][(a + 2) % 3] - p->facing[(a + 2) % 3] * axis[0][(a + 1) % 3];
}

static void axes_at(const struct proxy_surface *s, const struct proxy_place *p, const double point[3], double x[2])
{
    double axis[2][3];
    surface_axes(s, p, axis);
    for (int e = 0; e < 2; e++) {
        x[e] = 0.0;
        for (int a = 0; a < 3; a++) x[e] += (point[a] - p->hit.position_mm[a]) * axis[e][a];
    }
}

static void sample_pixel(void *context, size_t i)
{
    struct run *r = context;
    struct ray_field *f = &r->field;
    const struct proxy_place *p = &r->l->place[i];
    struct ray_pixel *to = &f->pixel[i];
    struct rng rng;
    double axis[2][3];
    *to = r->l->receiver[i];
    if (!to->used) return;
    if (!proxy_layers_receiver(r->s, p, i, axes_at, to)) to->depth_mm = -1, to->cell[0] = to->cell[1] = 1;
    surface_axes(r->s, p, axis);
    for (int e = 0; e < 2; e++)
        for (int a = 0; a < 3; a++) to->axis[e][a] = (float)axis[e][a];
    proxy_surface_random(r->s, i, 1, &rng);
    for (int a = 0; a < 2; a++) to->jitter[a] = (float)rng_double(&rng);
    for (size_t j2 = 0; j2 < f->n_side; j2++)
        for (size_t j1 = 0; j1 < f->n_side; j1++) {
            const double v[2] = {(double)ray_field_y(f, to, 0, j1), (double)ray_field_y(f, to, 1, j2)},
                         length = sqrt(1.0 + v[0] * v[0] + v[1] * v[1]);
            double d[3], height;
            for (int a = 0; a < 3; a++) d[a] = (p->facing[a] + v[0] * axis[0][a] + v[1] * axis[1][a]) / length;
            look(r->s, p, d, &rng, ray_field_value(f, i, j1, j2), &height);
            if (height > 0.0) ray_pixel_meet(to, (float)height);
        }
}

status proxy_bounce_make(const struct proxy_surface *s, struct thread_pool *pool, const struct progress *progress,
                         struct proxy_layers *l, struct error *err)
{
    struct run r = {.s = s, .l = l};
    if (s->q->no_bounce) return STATUS_OK;
    status st = ray_field_init(&r.field, s->q->width, s->q->height, s->q->n_side, 3, err);
    r.field.window = RAY_ABOVE;
    r.field.half = 5;
    const struct proxy_rays rays = {&r.field, s->q->way, sample_pixel, &r};
    if (st == STATUS_OK) st = proxy_rays_filter(&rays, pool, progress, l->bounce, err);
    ray_field_release(&r.field);
    return st;
}
