#include "renderer/preview/proxy/proxy_surface.h"
#include "renderer/scene/scene_place.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
#include <string.h>

/* Iteration numbers of the random streams; places on the lamp along an edge, and directions of the mean albedo. */
enum { ITERATION = 65520, REPLICA = 15, LAMP_PLACES = 2, ALBEDO_EDGE = 12, MOST_FACES = 12 };

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Direction with the density of its cosine over pi, on a side. */
static void cosine_direction(double u, double v, double side, double d[3])
{
    const double radius = sqrt(u);
    d[0] = radius * cos(2.0 * M_PI * v);
    d[1] = radius * sin(2.0 * M_PI * v);
    d[2] = side * sqrt(fmax(1.0 - u, 1e-4));
}

/* The mean over views on a side and lights on another, both by their cosines. side: 1 or -1. */
static void mean_share(const struct appearance_table *look, double view_side, double light_side, double share[3])
{
    const int n = ALBEDO_EDGE * ALBEDO_EDGE;
    for (int c = 0; c < 3; c++) share[c] = 0.0;
    for (int i = 0; i < n * n; i++) {
        const int o = i / n, l = i % n;
        double wo[3], wi[3], rgb[3];
        cosine_direction((o / ALBEDO_EDGE + 0.5) / ALBEDO_EDGE, (o % ALBEDO_EDGE + 0.5) / ALBEDO_EDGE, view_side, wo);
        cosine_direction((l / ALBEDO_EDGE + 0.5) / ALBEDO_EDGE, (l % ALBEDO_EDGE + 0.25) / ALBEDO_EDGE, light_side, wi);
        appearance_table_mean(look, wo, wi, rgb);
        for (int c = 0; c < 3; c++) share[c] += rgb[c] / fabs(wi[2]) / (double)(n * n);
    }
    for (int c = 0; c < 3; c++) share[c] = fmin(share[c], 1.0);
}

static void find_shares(struct proxy_surface *s)
{
    mean_share(s->q->look, 1.0, 1.0, s->albedo[0]);
    if (s->q->look->n_side < 2) return;
    mean_share(s->q->look, -1.0, -1.0, s->albedo[1]);
    mean_share(s->q->look, 1.0, -1.0, s->through);
}

status proxy_surface_init(struct proxy_surface *s, const struct proxy_request *q, struct error *err)
{
    memset(s, 0, sizeof *s);
    s->q = q;
    if (!scene_is_bent(q->scene) || q->width == 0 || q->height == 0 || q->width > RAY_MAX_EDGE ||
        q->height > RAY_MAX_EDGE || q->n_side == 0 || q->n_side > RAY_MAX_SIDE)
        return error_set(err, STATUS_INVALID, "cannot make a preview of %zu x %zu pixels with %zu x %zu rays each",
                         q->width, q->height, q->n_side, q->n_side);
    status st = configuration_check(q->configuration, 1, err);
    if (st != STATUS_OK) return st;
    camera_init(&s->camera, q->configuration);
    lights_init(&s->lights, q->configuration);
    s->thickness_mm = scene_thickness_mm(q->scene);
    s->pixel_mm = 1e3 * q->configuration->crop_m / (double)q->width;
    s->clear_mm = 0.5 * scene_proxy_edge_mm(q->scene);
    find_shares(s);
    return STATUS_OK;
}

bool proxy_surface_see(const struct proxy_surface *s, const struct camera *camera, const double xy[2],
                       struct proxy_place *p)
{
    double d[3], o[3];
    camera_direction(camera, xy, d);
    camera_origin(camera, xy, o);
    if (!scene_proxy_trace(s->q->scene, o, d, 0.0, &p->hit)) return false;
    const double side = p->hit.lower ? -1.0 : 1.0;
    for (int a = 0; a < 3; a++) {
        p->view[a] = -d[a];
        p->facing[a] = side * p->hit.normal[a];
    }
    return true;
}

/* A direction in the frame of the flat cloth; on the given side of it, at least. */
static void to_flat(const struct scene_proxy_hit *h, const double d[3], double flat[3])
{
    const double *n = h->normal, *t = h->weft;
    const double warp[3] = {n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
    flat[0] = dot(d, t);
    flat[1] = dot(d, warp);
    flat[2] = dot(d, n);
}

/* Radiance of the place under light from a direction with irradiance pi on a surface that faces it. */
static void radiance_of(const struct proxy_surface *s, const struct proxy_place *p, const double direction[3],
                        double rgb[3])
{
    double wo[3], wi[3];
    to_flat(&p->hit, p->view, wo);
    to_flat(&p->hit, direction, wi);
    const double side = p->hit.lower ? -1.0 : 1.0;
    wo[2] = side * fmax(side * wo[2], 1e-3); /* a smooth normal may look away a little */
    if (s->q->look->n_side == 1 && (wi[2] <= 0.0 || p->hit.lower)) {
        rgb[0] = rgb[1] = rgb[2] = 0.0;
        return;
    }
    appearance_table_mean(s->q->look, wo, wi, rgb);
}

double proxy_surface_to_lamp(const struct proxy_surface *s, const double p_mm[3], const double y[2], double d[3])
{
    const struct lamp *l = &s->lights.lamp;
    double along = 0.0, length = 0.0;
    for (int a = 0; a < 3; a++) {
        const double edges = y[0] * (double)l->edge[0][a] + y[1] * (double)l->edge[1][a];
        d[a] = l->distant ? edges - (double)l->normal[a] : (double)l->centre_mm[a] + edges - p_mm[a];
        along -= d[a] * (double)l->normal[a];
        length += d[a] * d[a];
    }
    for (int a = 0; a < 3; a++) d[a] /= sqrt(length);
    return !(along > 0.0) ? 0.0 : l->distant ? INFINITY : along;
}

/* Calls for light from LAMP_PLACES x LAMP_PLACES points of the lamp: direction, and irradiance over pi of each. */
static int lamp_points(const struct proxy_surface *s, const double p_mm[3], double direction[][3], double *light)
{
    const struct lamp *l = &s->lights.lamp;
    const int n = l->directional ? 1 : LAMP_PLACES * LAMP_PLACES;
    int count = 0;
    for (int i = 0; i < n && s->lights.has_lamp; i++) {
        const float at[3] = {(float)p_mm[0], (float)p_mm[1], (float)p_mm[2]},
                    u[2] = {((float)(i % LAMP_PLACES) + 0.5f) / LAMP_PLACES,
                            ((float)(i / LAMP_PLACES) + 0.5f) / LAMP_PLACES};
        float d[3], pdf;
        if (!lamp_sample(l, at, u, d, &pdf)) continue;
        for (int a = 0; a < 3; a++) direction[count][a] = (double)d[a];
        light[count++] = (double)(lamp_radiance(l, d) / pdf) / (M_PI * n);
    }
    return count;
}

void proxy_surface_direct(const struct proxy_surface *s, const struct proxy_place *p, double rgb[3])
{
    double direction[LAMP_PLACES * LAMP_PLACES][3], light[LAMP_PLACES * LAMP_PLACES], one[3];
    const int n = lamp_points(s, p->hit.position_mm, direction, light);
    rgb[0] = rgb[1] = rgb[2] = 0.0;
    for (int i = 0; i < n; i++) {
        radiance_of(s, p, direction[i], one);
        for (int c = 0; c < 3; c++) rgb[c] += light[i] * one[c];
    }
}

double proxy_surface_light(const struct proxy_surface *s, const double p_mm[3], const double normal[3])
{
    double direction[LAMP_PLACES * LAMP_PLACES][3], light[LAMP_PLACES * LAMP_PLACES], sum = 0.0;
    const int n = lamp_points(s, p_mm, direction, light);
    for (int i = 0; i < n; i++) sum += light[i] * fmax(0.0, dot(direction[i], normal));
    return sum;
}

void proxy_surface_start(const struct proxy_surface *s, const struct scene_proxy_hit *h, const double d[3],
                         double start[3])
{
    const double above = dot(d, h->normal) >= 0.0 ? 1.0 : -1.0;
    double move = 0.25 * s->clear_mm;
    if ((above < 0.0) != h->lower) move += s->thickness_mm;
    for (int a = 0; a < 3; a++) start[a] = h->position_mm[a] + above * move * h->normal[a];
}

bool proxy_surface_pixel(const struct proxy_surface *s, const double p_mm[3], double pixel[2])
{
    const struct camera *m = &s->camera;
    const size_t size[2] = {s->q->width, s->q->height};
    double to[3], forward[3], depth = 0.0, middle = 0.0;
    for (int a = 0; a < 3; a++) {
        to[a] = p_mm[a] - m->eye_mm[a];
        forward[a] = -m->eye_mm[a];
    }
    depth = dot(to, forward);
    middle = dot(forward, forward);
    if (!(depth > 0.0)) return false;
    const double scale = m->far_field ? 1.0 : middle / depth;
    const double *edge[2] = {m->right_mm, m->up_mm};
    for (int k = 0; k < 2; k++) {
        const double at = scale * dot(to, edge[k]) / dot(edge[k], edge[k]);
        pixel[k] = (k == 0 ? 0.5 + at : 0.5 - at) * (double)size[k];
    }
    return true;
}

bool proxy_surface_layers(const struct proxy_surface *s, const double start[3], const double d[3],
                          struct scene_proxy_hit *first, double share[3])
{
    struct scene_proxy_hit hit;
    double from = s->clear_mm;
    int n_face = 0;
    for (int c = 0; c < 3; c++) share[c] = 1.0;
    while (n_face < MOST_FACES && scene_proxy_trace(s->q->scene, start, d, from, &hit)) {
        if (n_face == 0) *first = hit;
        from = hit.distance_mm * (1.0 + 1e-6) + 1e-4;
        /* a layer has two faces */
        for (int c = 0; c < 3 && n_face % 2 == 0; c++) share[c] *= s->through[c];
        n_face++;
        if (!(share[0] + share[1] + share[2] > 1e-3)) break;
    }
    return n_face > 0;
}

void proxy_surface_random(const struct proxy_surface *s, size_t i_pixel, unsigned purpose, struct rng *rng)
{
    const struct rng_key key = {s->q->seed, ITERATION + purpose, REPLICA, s->q->stream};
    rng_start(rng, &key, (uint32_t)i_pixel, 0);
}
