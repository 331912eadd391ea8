#include "renderer/preview/studio_ground.h"
#include "renderer/scene/scene_place.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/lights.h"

#include <math.h>
#include <string.h>

/* Pixels an edge of a field of the coarse grid; rays to each of the two lights from a field. Noise of fields is
 * smoothed over FIELD_REACH fields to each side, in FIELD_PASSES passes of twice the step of the one before, between
 * fields that differ by less than noise does. */
enum {
    FIELD_PX = 4,
    FIELD_RAYS = 96,
    FIELD_REACH = 2,
    FIELD_PASSES = 2,
    FIELD_CHANNELS = 4,
    ITERATION_OF_FIELDS = 65531,
    ITERATION_OF_PIXELS = 65530,
    REPLICA = 15
};
enum { MOST_LAYERS = 5, COARSE_SIDE = 2 };

struct run {
    const struct ground_request *q;
    const struct progress *progress;
    struct camera camera;
    struct lights lights;
    struct image light; /* of the fields: radiance of the ground, and its variance (green) */
    struct image *im;
};

/* Where the ray through a point of the picture meets the ground. */
static bool meet(const struct run *r, const double xy[2], double p_mm[3])
{
    double d[3], o[3];
    camera_direction(&r->camera, xy, d);
    camera_origin(&r->camera, xy, o);
    const double t = (r->q->z_mm - o[2]) / d[2];
    if (!(t > 0.0) || !isfinite(t)) return false;
    for (int a = 0; a < 3; a++) p_mm[a] = o[a] + t * d[a];
    return true;
}

/* The share of light from a direction that comes through the layers of the cloth to a point of the ground. */
static void come_through(const struct run *r, const double p_mm[3], const float direction[3], float share[3])
{
    struct scene_ray ray;
    struct scene_layer layer;
    double d[3];
    float from[3];
    for (int a = 0; a < 3; a++) {
        d[a] = (double)direction[a];
        from[a] = (float)p_mm[a];
        share[a] = 1;
    }
    if (!scene_ray_enter(r->q->scene, p_mm, d, &ray) || !scene_occluded(r->q->scene, &ray)) return;
    int n = 0;
    for (; r->q->through != NULL && n < MOST_LAYERS && scene_shell_meets(r->q->scene, from, direction, &layer); n++) {
        for (int c = 0; c < 3; c++) share[c] *= r->q->through[c];
        memcpy(from, layer.behind_mm, sizeof from);
    }
    if (n == 0 || n == MOST_LAYERS) memset(share, 0, 3 * sizeof *share);
}

static void add_lamp(const struct run *r, const double p_mm[3], const float u[2], float rgb[3])
{
    const float position[3] = {(float)p_mm[0], (float)p_mm[1], (float)p_mm[2]};
    float direction[3], share[3], pdf;
    if (!r->lights.has_lamp || !lamp_sample(&r->lights.lamp, position, u, direction, &pdf) || !(direction[2] > 0))
        return;
    const float light = lamp_radiance(&r->lights.lamp, direction) * direction[2] / pdf * (float)(r->q->albedo * M_1_PI);
    come_through(r, p_mm, direction, share);
    for (int c = 0; c < 3; c++) rgb[c] += light * share[c];
}

/* By a direction with the density cosine over pi. */
static void add_environment(const struct run *r, const double p_mm[3], const float u[2], float rgb[3])
{
    const float radius = sqrtf(u[0]), phi = 2 * (float)M_PI * u[1];
    const float direction[3] = {radius * cosf(phi), radius * sinf(phi), sqrtf(fmaxf(1 - u[0], 1e-6f))};
    float light[3] = {0, 0, 0}, share[3];
    come_through(r, p_mm, direction, share);
    lights_add_environment(&r->lights, direction, 0, light);
    for (int c = 0; c < 3; c++) rgb[c] += light[c] * share[c] * (float)r->q->albedo;
}

/* Points of a rank-1 lattice, shifted at random for each field. */
static void light_field(const struct run *r, size_t x, size_t y, float rgb[FIELD_CHANNELS])
{
    const struct rng_key key = {r->q->seed, ITERATION_OF_FIELDS, REPLICA, r->q->stream};
    const double xy[2] = {((double)x + 0.5) / (double)r->light.width, ((double)y + 0.5) / (double)r->light.height};
    double p[3], sum[3] = {0, 0, 0}, square[2] = {0, 0}, mean[2] = {0, 0};
    struct rng rng;
    rng_start(&rng, &key, (uint32_t)(y * r->light.width + x), 0);
    if (!meet(r, xy, p)) return;
    for (int pass = 0; pass < 2; pass++) {
        const float shift[2] = {rng_float(&rng), rng_float(&rng)};
        for (int i = 0; i < FIELD_RAYS; i++) {
            const float u[2] = {fmodf(((float)i + 0.5f) / FIELD_RAYS + shift[0], 1),
                                fmodf((float)i * 0.61803399f + shift[1], 1)};
            float one[3] = {0, 0, 0};
            if (pass == 0)
                add_lamp(r, p, u, one);
            else
                add_environment(r, p, u, one);
            for (int c = 0; c < 3; c++) sum[c] += (double)one[c] / FIELD_RAYS;
            mean[pass] += (double)one[1] / FIELD_RAYS;
            square[pass] += (double)one[1] * (double)one[1] / FIELD_RAYS;
        }
    }
    for (int c = 0; c < 3; c++) rgb[c] = (float)sum[c];
    for (int pass = 0; pass < 2; pass++)
        rgb[3] += (float)(fmax(square[pass] - mean[pass] * mean[pass], 0.0) / FIELD_RAYS);
}

/* One field of a pass of the smoothing. */
static void smooth_field(const struct image *from, size_t x, size_t y, size_t step, float out[FIELD_CHANNELS])
{
    const float *here = from->pixel + (y * from->width + x) * FIELD_CHANNELS;
    double sum[3] = {0, 0, 0}, variance = 0, weight = 0;
    for (int dy = -FIELD_REACH; dy <= FIELD_REACH; dy++)
        for (int dx = -FIELD_REACH; dx <= FIELD_REACH; dx++) {
            const long at[2] = {(long)x + dx * (long)step, (long)y + dy * (long)step};
            if (at[0] < 0 || at[1] < 0 || at[0] >= (long)from->width || at[1] >= (long)from->height) continue;
            const float *there = from->pixel + ((size_t)at[1] * from->width + (size_t)at[0]) * FIELD_CHANNELS;
            const double d = (double)(there[1] - here[1]), noise = (double)(here[3] + there[3]);
            const double w = exp(-0.25 * (dx * dx + dy * dy) - 0.5 * (noise > 0 ? d * d / noise : d == 0 ? 0 : 1e3));
            for (int c = 0; c < 3; c++) sum[c] += w * (double)there[c];
            variance += w * w * (double)there[3];
            weight += w;
        }
    for (int c = 0; c < 3; c++) out[c] = (float)(sum[c] / weight);
    out[3] = (float)(variance / (weight * weight));
}

static status smooth_fields(struct image *light, struct error *err)
{
    struct image from;
    status s = image_init(&from, light->width, light->height, FIELD_CHANNELS, err);
    if (s != STATUS_OK) return s;
    for (size_t pass = 0; pass < FIELD_PASSES; pass++) {
        memcpy(from.pixel, light->pixel, light->width * light->height * FIELD_CHANNELS * sizeof *light->pixel);
        for (size_t y = 0; y < light->height; y++)
            for (size_t x = 0; x < light->width; x++)
                smooth_field(&from, x, y, (size_t)1 << pass, light->pixel + (y * light->width + x) * FIELD_CHANNELS);
    }
    image_release(&from);
    return STATUS_OK;
}

static void run_field_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    for (size_t x = 0; x < r->light.width && !progress_cancelled(r->progress); x++)
        light_field(r, x, y, r->light.pixel + (y * r->light.width + x) * FIELD_CHANNELS);
}

/* Linear between the middles of fields. */
static void light_at(const struct image *light, const double at[2], float rgb[3])
{
    const size_t n[2] = {light->width, light->height};
    size_t low[2], high[2];
    double part[2];
    for (int a = 0; a < 2; a++) {
        const double v = fmin(fmax(at[a] * (double)n[a] - 0.5, 0.0), (double)(n[a] - 1));
        low[a] = (size_t)v;
        high[a] = low[a] + 1 < n[a] ? low[a] + 1 : low[a];
        part[a] = v - (double)low[a];
    }
    for (size_t c = 0; c < 3; c++) {
        const float *p = light->pixel + c;
        const size_t k = FIELD_CHANNELS;
        const double above = (1 - part[0]) * (double)p[k * (low[1] * n[0] + low[0])] +
                             part[0] * (double)p[k * (low[1] * n[0] + high[0])],
                     below = (1 - part[0]) * (double)p[k * (high[1] * n[0] + low[0])] +
                             part[0] * (double)p[k * (high[1] * n[0] + high[0])];
        rgb[c] = (float)((1 - part[1]) * above + part[1] * below);
    }
}

static bool sees_ground(const struct run *r, const double xy[2])
{
    double p[3];
    struct scene_ray ray;
    return meet(r, xy, p) && !(camera_ray(&r->camera, r->q->scene, xy, &ray) && scene_occluded(r->q->scene, &ray));
}

/* The share of a pixel in which the ground is seen, by side x side rays, one in each part of the pixel. */
static double share_seen(const struct run *r, size_t x, size_t y, size_t side, struct rng *rng)
{
    const struct ground_request *q = r->q;
    size_t n = 0;
    for (size_t i = 0; i < side * side; i++) {
        const double xy[2] = {((double)x + ((double)(i % side) + rng_double(rng)) / (double)side) / (double)q->width,
                              ((double)y + ((double)(i / side) + rng_double(rng)) / (double)side) / (double)q->height};
        n += sees_ground(r, xy);
    }
    return (double)n / (double)(side * side);
}

static void run_row(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    const struct ground_request *q = r->q;
    const struct rng_key key = {q->seed, ITERATION_OF_PIXELS, REPLICA, q->stream};
    const size_t side = (size_t)lround(ceil(sqrt((double)q->n_sample)));
    for (size_t x = 0; x < q->width && !progress_cancelled(r->progress); x++) {
        const double middle[2] = {((double)x + 0.5) / (double)q->width, ((double)y + 0.5) / (double)q->height};
        struct rng rng;
        float *out = r->im->pixel + (y * q->width + x) * r->im->n_channel;
        rng_start(&rng, &key, (uint32_t)(y * q->width + x), 0);
        double seen = share_seen(r, x, y, COARSE_SIDE, &rng);
        if (seen > 0 && seen < 1) seen = share_seen(r, x, y, side, &rng);
        light_at(&r->light, middle, out);
        for (int c = 0; c < 3; c++) out[c] *= (float)seen;
    }
}

static status check(const struct run *r, struct error *err)
{
    const struct ground_request *q = r->q;
    if (scene_is_bent(q->scene) && q->n_sample > 0 && q->width > 0 && q->height > 0 && q->width <= 65536 &&
        q->height <= 65536 && r->camera.eye_mm[2] > q->z_mm)
        return STATUS_OK;
    return error_set(err, STATUS_INVALID, "cannot render the ground under a cloth in %zu x %zu pixels of %zu rays",
                     q->width, q->height, q->n_sample);
}

status studio_ground_render(const struct ground_request *q, struct thread_pool *pool, const struct progress *progress,
                            struct image *im, struct error *err)
{
    struct run r = {.q = q, .progress = progress, .im = im};
    memset(im, 0, sizeof *im);
    status s = configuration_check(q->configuration, 1, err);
    if (s != STATUS_OK) return s;
    camera_init(&r.camera, q->configuration);
    lights_init(&r.lights, q->configuration);
    s = check(&r, err);
    if (s == STATUS_OK) s = image_init(im, q->width, q->height, 6, err);
    if (s == STATUS_OK)
        s = image_init(&r.light, (q->width + FIELD_PX - 1) / FIELD_PX, (q->height + FIELD_PX - 1) / FIELD_PX,
                       FIELD_CHANNELS, err);
    if (s == STATUS_OK) s = thread_pool_run(pool, r.light.height, run_field_row, &r, progress);
    if (s == STATUS_OK) s = smooth_fields(&r.light, err);
    if (s == STATUS_OK) s = thread_pool_run(pool, q->height, run_row, &r, progress);
    if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
    image_release(&r.light);
    if (s == STATUS_OK) return s;
    image_release(im);
    return s == STATUS_CANCELLED ? error_set(err, s, "rendering the ground was cancelled") : s;
}
