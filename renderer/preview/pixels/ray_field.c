#include "renderer/preview/pixels/ray_field.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* SMOOTH: pixels to each side; ABOVE_ROUNDS times it is the reach of a filter. */
enum { SMOOTH = 2, ABOVE_ROUNDS = RAY_REACH / SMOOTH };
static const float cos_20_deg = 0.93969262f, least_of_cubic = 0.3f;

status ray_field_init(struct ray_field *f, size_t width, size_t height, size_t n_side, size_t n_channel,
                      struct error *err)
{
    *f = (struct ray_field){.width = width, .height = height, .n_side = n_side, .n_channel = n_channel};
    if (width == 0 || height == 0 || width > RAY_MAX_EDGE || height > RAY_MAX_EDGE || n_side == 0 ||
        n_side > RAY_MAX_SIDE || (n_channel != 1 && n_channel != RAY_MAX_CHANNEL))
        return error_set(err, STATUS_INVALID,
                         "cannot filter %zu x %zu pixels with %zu x %zu rays each: allowed are at most %d pixels and "
                         "%d rays a side",
                         width, height, n_side, n_side, RAY_MAX_EDGE, RAY_MAX_SIDE);
    f->pixel = calloc(width * height, sizeof *f->pixel);
    f->value = calloc(width * height, n_side * n_side * n_channel * sizeof *f->value);
    if (f->pixel != NULL && f->value != NULL) return STATUS_OK;
    ray_field_release(f);
    return error_set(err, STATUS_NO_MEMORY, "cannot filter %zu x %zu pixels: out of memory", width, height);
}

void ray_field_release(struct ray_field *f)
{
    free(f->pixel);
    free(f->value);
    memset(f, 0, sizeof *f);
}

/* The place within the strata, in [-1, 1). */
static float stratum(const struct ray_field *f, const struct ray_pixel *p, int axis, size_t i)
{
    return 2 * ((float)i + p->jitter[axis]) / (float)f->n_side - 1;
}

float ray_field_y(const struct ray_field *f, const struct ray_pixel *p, int axis, size_t i)
{
    const float t = stratum(f, p, axis, i);
    if (f->window != RAY_ABOVE) return f->half * t;
    return f->half * t * (least_of_cubic + (1 - least_of_cubic) * t * t);
}

float ray_field_weight(const struct ray_field *f, const struct ray_pixel *p, size_t i_first, size_t i_second)
{
    if (f->window != RAY_ABOVE) return 1;
    const size_t i[2] = {i_first, i_second};
    float density = 1, square = 1;
    for (int a = 0; a < 2; a++) {
        const float t = stratum(f, p, a, i[a]), v = ray_field_y(f, p, a, i[a]);
        density *= least_of_cubic + 3 * (1 - least_of_cubic) * t * t;
        square += v * v;
    }
    return density / (square * square);
}

float *ray_field_value(const struct ray_field *f, size_t i_pixel, size_t i_first, size_t i_second)
{
    return f->value + ((i_pixel * f->n_side + i_second) * f->n_side + i_first) * f->n_channel;
}

void ray_pixel_meet(struct ray_pixel *p, float slope)
{
    if (slope == 0 || !isfinite(slope)) return;
    const bool first = p->slope[0] == 0 && p->slope[1] == 0;
    p->slope[0] = first ? slope : fminf(p->slope[0], slope);
    p->slope[1] = first ? slope : fmaxf(p->slope[1], slope);
}

bool ray_pixel_near(const struct ray_pixel *p, const struct ray_pixel *q)
{
    float cosine = 0, from_plane = 0, length2 = 0;
    if (!q->used) return false;
    for (int a = 0; a < 3; a++) {
        cosine += p->normal[a] * q->normal[a];
        from_plane += p->normal[a] * (q->place_mm[a] - p->place_mm[a]);
        length2 += p->normal[a] * p->normal[a];
    }
    return !(length2 > 0) || (cosine > cos_20_deg && fabsf(from_plane) < p->depth_mm);
}

static void mean_slopes(const struct ray_field *f, long x, long y, float mean[2])
{
    const struct ray_pixel *own = &f->pixel[(size_t)y * f->width + (size_t)x];
    float n = 0, sum[2] = {0, 0};
    for (long v = y - SMOOTH; v <= y + SMOOTH; v++)
        for (long u = x - SMOOTH; u <= x + SMOOTH; u++) {
            if (u < 0 || v < 0 || u >= (long)f->width || v >= (long)f->height) continue;
            const struct ray_pixel *p = &f->pixel[(size_t)v * f->width + (size_t)u];
            if ((p->slope[0] == 0 && p->slope[1] == 0) || !ray_pixel_near(own, p)) continue;
            n++;
            for (int k = 0; k < 2; k++) sum[k] += p->slope[k];
        }
    for (int k = 0; k < 2; k++) mean[k] = n > 0 ? sum[k] / n : 0;
}

status ray_field_smooth_slopes(struct ray_field *f, struct error *err)
{
    const size_t n = f->width * f->height;
    float(*smooth)[2] = calloc(n, sizeof *smooth);
    if (smooth == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter a picture: out of memory");
    for (int round = 0; round < (f->window == RAY_ABOVE ? ABOVE_ROUNDS : 1); round++) {
        for (size_t i = 0; i < n; i++) {
            const float *own = f->pixel[i].slope;
            if (round > 0 && (own[0] != 0 || own[1] != 0)) continue;
            if (f->pixel[i].used) mean_slopes(f, (long)(i % f->width), (long)(i / f->width), smooth[i]);
        }
        for (size_t i = 0; i < n; i++) memcpy(f->pixel[i].slope, smooth[i], sizeof smooth[i]);
    }
    free(smooth);
    return STATUS_OK;
}
