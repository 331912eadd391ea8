/* Weights of the filters of ray_filter.h at one pixel, for the files of this folder. y is in units of half. */
#ifndef SELVEDGE_RENDERER_RAY_KERNEL_H
#define SELVEDGE_RENDERER_RAY_KERNEL_H

#include "renderer/preview/pixels/ray_field.h"

#include <math.h>
#include <stdint.h>

/* A weighted sum of values, and of the weights. */
struct ray_sum {
    float all, value[RAY_MAX_CHANNEL];
};

struct ray_kernel {
    enum ray_window window;
    bool sheared;      /* false: by axes */
    float over_var[2]; /* 1 / (2 sigma_x^2) along each axis */
    float shift[2];    /* eta / half along each axis */
    float wide[2];     /* of RAY_SQUARE: sigma_x eta sqrt(2) / half */
    float middle[2];   /* of RAY_SQUARE: 2 erf(1 / wide) */
};

/* False: no ray of the pixel has met anything, so there is no filter. */
static inline bool ray_kernel_at(const struct ray_field *f, const struct ray_pixel *p, bool by_axes,
                                 struct ray_kernel *k)
{
    const float low = p->slope[0], high = p->slope[1], nearest = fminf(fabsf(low), fabsf(high));
    *k = (struct ray_kernel){.window = f->window, .sheared = !by_axes && low * high > 0};
    if (!p->used || (low == 0 && high == 0)) return false;
    /* sigma_y of the window: half / 2, and for directions 2 / 2.8, the band limit of their weight */
    const float sigma_y = f->window == RAY_ABOVE ? 2 / 2.8f : 0.5f * f->half;
    for (int a = 0; a < 2; a++) {
        const float cell = fabsf(p->cell[a]);
        float sigma = low * high > 0 ? sigma_y * nearest / 3 : 0, eta = 0;
        if (k->sheared) {
            sigma = sigma_y * low * high / (high - low); /* infinite for one slope */
            eta = 0.5f * (low + high) / (low * high);
        }
        sigma = fminf(fmaxf(sigma, 0.25f * cell), 0.5f * (float)RAY_REACH * cell);
        k->over_var[a] = 0.5f / (sigma * sigma);
        k->shift[a] = eta / f->half;
        k->wide[a] = sigma * fabsf(eta) / f->half * 1.41421356f;
        k->middle[a] = f->window == RAY_SQUARE ? 2 * erff(1 / k->wide[a]) : 0;
    }
    return true;
}

static inline float ray_weight_x(const struct ray_kernel *k, int a, float offset)
{
    return expf(-offset * offset * k->over_var[a]);
}

/* Weight of a ray that counts as one to y. */
static inline float ray_weight_y(const struct ray_kernel *k, int a, float y)
{
    if (!(fabsf(y) <= 1)) return 0;
    if (k->window == RAY_ABOVE) return 1;
    if (k->window == RAY_GAUSSIAN) return expf(-2 * y * y);
    if (!(k->wide[a] > 0)) return 1;
    return k->middle[a] / (erff((1 - y) / k->wide[a]) + erff((1 + y) / k->wide[a]));
}

static inline void ray_sum_add(struct ray_sum *to, float weight, const struct ray_sum *s)
{
    to->all += weight * s->all;
    for (int c = 0; c < RAY_MAX_CHANNEL; c++) to->value[c] += weight * s->value[c];
}

/* Adds a ray. */
static inline void ray_sum_ray(struct ray_sum *to, const struct ray_field *f, float weight, const float *value)
{
    to->all += weight;
    for (size_t c = 0; c < f->n_channel; c++) to->value[c] += weight * value[c];
}

/* The pixel's own rays. */
static inline struct ray_sum ray_sum_own(const struct ray_field *f, size_t i)
{
    const struct ray_kernel plain = {.window = f->window};
    const struct ray_pixel *p = &f->pixel[i];
    struct ray_sum sum = {0};
    if (!p->used) return sum;
    for (size_t j2 = 0; j2 < f->n_side; j2++)
        for (size_t j1 = 0; j1 < f->n_side; j1++) {
            const float weight = ray_weight_y(&plain, 0, ray_field_y(f, p, 0, j1) / f->half) *
                                 ray_weight_y(&plain, 1, ray_field_y(f, p, 1, j2) / f->half) *
                                 ray_field_weight(f, p, j1, j2);
            ray_sum_ray(&sum, f, weight, ray_field_value(f, i, j1, j2));
        }
    return sum;
}

/* Writes the mean of a sum; of an empty one the mean of the pixel's own rays. */
static inline void ray_sum_mean(const struct ray_field *f, size_t i, const struct ray_sum *sum, float *mean)
{
    const struct ray_sum own = sum->all > 0 ? *sum : ray_sum_own(f, i);
    for (size_t c = 0; c < f->n_channel; c++) mean[i * f->n_channel + c] = own.all > 0 ? own.value[c] / own.all : 0;
}

/* The pixel `offset` ways along an axis from pixel i; SIZE_MAX: it lies outside, or on another surface. */
static inline size_t ray_neighbour(const struct ray_field *f, size_t i, int axis, int offset)
{
    const struct ray_pixel *p = &f->pixel[i];
    const long x = (long)(i % f->width) + lroundf((float)offset * p->step[axis][0]),
               y = (long)(i / f->width) + lroundf((float)offset * p->step[axis][1]);
    if (x < 0 || y < 0 || x >= (long)f->width || y >= (long)f->height) return SIZE_MAX;
    const size_t at = (size_t)y * f->width + (size_t)x;
    return at == i || ray_pixel_near(p, &f->pixel[at]) ? at : SIZE_MAX;
}

#endif
