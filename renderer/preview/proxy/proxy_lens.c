/* The picture through a lens, or of a pinhole with smooth edges, from the filtered layers of the pinhole picture. */
#include "renderer/preview/proxy/proxy_layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rays of pixels on both sides of the plane in focus, besides the rays of all pixels (section 5.5). */
enum { EXTRA_RAYS = 36 };

struct run {
    const struct proxy_surface *s;
    const struct proxy_layers *l;
    struct ray_field field;
    bool lens;
};

/* Adds the layers of a pixel if it shows the same surface as `at`. */
static float add_layers(const struct run *r, const struct ray_pixel *at, long x, long y, float weight, float layer[6])
{
    const struct proxy_request *q = r->s->q;
    if (x < 0 || y < 0 || x >= (long)q->width || y >= (long)q->height || !(weight > 0)) return 0;
    const size_t i = (size_t)y * q->width + (size_t)x;
    if (!ray_pixel_near(at, &r->l->receiver[i])) return 0;
    for (size_t c = 0; c < 3; c++) {
        layer[c] += weight * r->l->visible[3 * i + c];
        layer[3 + c] += weight * r->l->bounce[3 * i + c];
    }
    return weight;
}

/* Light of the lamp that comes, and irradiance over pi, at a place, from pixels that show it. False: none does. */
static bool find_layers(const struct run *r, const struct proxy_place *p, float layer[6])
{
    struct ray_pixel at = {.used = true, .depth_mm = (float)(3.0 * r->s->pixel_mm)};
    double pixel[2];
    float sum = 0;
    memset(layer, 0, 6 * sizeof *layer);
    if (!proxy_surface_pixel(r->s, p->hit.position_mm, pixel)) return false;
    for (int a = 0; a < 3; a++) {
        at.place_mm[a] = (float)p->hit.position_mm[a];
        at.normal[a] = (float)p->facing[a];
    }
    const double left = floor(pixel[0] - 0.5), top = floor(pixel[1] - 0.5);
    const float part[2] = {(float)(pixel[0] - 0.5 - left), (float)(pixel[1] - 0.5 - top)};
    if (!(fabs(left) < 1e6 && fabs(top) < 1e6)) return false;
    for (int k = 0; k < 4; k++)
        sum += add_layers(r, &at, (long)left + (k & 1), (long)top + (k >> 1),
                          ((k & 1) ? part[0] : 1 - part[0]) * ((k >> 1) ? part[1] : 1 - part[1]), layer);
    for (long k = 0; k < 9 && !(sum > 0); k++)
        sum += add_layers(r, &at, (long)left + k % 3 - 1, (long)top + k / 3 - 1, 1, layer);
    for (int c = 0; c < 6 && sum > 0; c++) layer[c] /= sum;
    return sum > 0;
}

/* One ray to the lamp, for places that the pinhole does not see. */
static void look_at_lamp(const struct run *r, const struct proxy_place *p, struct rng *rng, float share[3])
{
    const struct lamp *l = &r->s->lights.lamp;
    const double half = l->directional ? 0.0 : l->distant ? 1.0 / sqrt((double)l->sharpness) : (double)l->half_side_mm;
    const double y[2] = {(2.0 * rng_double(rng) - 1.0) * half, (2.0 * rng_double(rng) - 1.0) * half};
    double d[3], start[3], layers[3];
    struct scene_proxy_hit hit;
    if (!r->s->lights.has_lamp || !(proxy_surface_to_lamp(r->s, p->hit.position_mm, y, d) > 0.0)) return;
    proxy_surface_start(r->s, &p->hit, d, start);
    proxy_surface_layers(r->s, start, d, &hit, layers);
    for (int c = 0; c < 3; c++) share[c] = (float)layers[c];
}

static void shade(const struct run *r, const struct proxy_place *p, struct rng *rng, float rgb[3])
{
    double direct[3];
    float layer[6];
    proxy_surface_direct(r->s, p, direct);
    if (!find_layers(r, p, layer)) look_at_lamp(r, p, rng, layer);
    for (int c = 0; c < 3; c++)
        rgb[c] = (float)direct[c] * layer[c] + (float)r->s->albedo[p->hit.lower][c] * layer[3 + c];
}

/* The ray of a camera at a place of the lens, in units of its radius. Counts how far the place that it meets moves. */
static void see(const struct run *r, size_t i, const double lens[2], struct rng *rng, struct ray_pixel *to,
                float rgb[3])
{
    const struct proxy_request *q = r->s->q;
    const double size[2] = {(double)q->width, (double)q->height};
    double xy[2] = {((double)(i % q->width) + rng_double(rng)) / size[0],
                    ((double)(i / q->width) + rng_double(rng)) / size[1]};
    const struct camera *m = &r->s->camera;
    struct camera pinhole = *m;
    struct proxy_place p;
    rgb[0] = rgb[1] = rgb[2] = 0;
    if (r->lens) camera_at_lens(m, lens, &pinhole, xy);
    if (!proxy_surface_see(r->s, &pinhole, xy, &p)) return;
    shade(r, &p, rng, rgb);
    double depth = 0.0, middle = 0.0;
    for (int a = 0; a < 3; a++) {
        depth += (m->eye_mm[a] - p.hit.position_mm[a]) * m->eye_mm[a];
        middle += m->eye_mm[a] * m->eye_mm[a];
    }
    const double focus_m = q->configuration->focus_m, distance = sqrt(middle),
                 focus = focus_m > 0.0 ? 1e3 * focus_m : distance;
    if (r->lens) ray_pixel_meet(to, (float)((distance * distance / depth - distance / focus) / r->s->pixel_mm));
}

static void sample_pixel(void *context, size_t i)
{
    struct run *r = context;
    struct ray_field *f = &r->field;
    struct ray_pixel *to = &f->pixel[i];
    const double radius = r->s->camera.lens_mm;
    const size_t n = f->n_side * f->n_side;
    struct rng rng;
    *to = (struct ray_pixel){
        .x = {(float)(i % f->width), (float)(i / f->width)}, .step = {{1, 0}, {0, 1}}, .cell = {1, 1}, .used = true};
    proxy_surface_random(r->s, i, 2, &rng);
    for (int a = 0; a < 2; a++) to->jitter[a] = (float)rng_double(&rng);
    for (size_t j2 = 0; j2 < f->n_side; j2++)
        for (size_t j1 = 0; j1 < f->n_side; j1++) {
            /* y of the second axis goes down on the screen */
            const double lens[2] = {r->lens ? (double)ray_field_y(f, to, 0, j1) / radius : 0.0,
                                    r->lens ? -(double)ray_field_y(f, to, 1, j2) / radius : 0.0};
            see(r, i, lens, &rng, to, ray_field_value(f, i, j1, j2));
        }
    if (!(to->slope[0] < 0 && to->slope[1] > 0)) return;
    float sum[3] = {0, 0, 0}, rgb[3];
    for (int k = 0; k < EXTRA_RAYS; k++) {
        const double angle = 2.0 * M_PI * rng_double(&rng), at = sqrt(((double)k + rng_double(&rng)) / EXTRA_RAYS),
                     lens[2] = {at * cos(angle), at * sin(angle)};
        see(r, i, lens, &rng, to, rgb);
        for (int c = 0; c < 3; c++) sum[c] += rgb[c] / EXTRA_RAYS;
    }
    for (size_t j = 0; j < n; j++) memcpy(f->value + (i * n + j) * 3, sum, sizeof sum);
}

status proxy_lens_make(const struct proxy_surface *s, const struct proxy_layers *l, struct thread_pool *pool,
                       const struct progress *progress, float *rgb, struct error *err)
{
    struct run r = {.s = s, .l = l, .lens = s->camera.lens_mm > 0.0};
    status st = ray_field_init(&r.field, s->q->width, s->q->height, s->q->n_side, 3, err);
    r.field.window = r.lens ? RAY_GAUSSIAN : RAY_SQUARE;
    r.field.half = r.lens ? (float)s->camera.lens_mm : 1;
    const struct proxy_rays rays = {&r.field, r.lens ? s->q->way : RAY_OWN, sample_pixel, &r};
    if (st == STATUS_OK) st = proxy_rays_filter(&rays, pool, progress, rgb, err);
    ray_field_release(&r.field);
    return st;
}
