/* The filters but the four passes. */
#include "renderer/preview/pixels/ray_filter.h"
#include "renderer/preview/pixels/ray_kernel.h"

#include <stdint.h>
#include <stdlib.h>

struct run {
    const struct ray_field *f;
    enum ray_filter_way way;
    const struct progress *progress;
    struct ray_sum *first, *second; /* of each pixel; by axes */
    float *mean;
};

/* Weights of the rays of q along an axis, as rays of p. */
static void weigh(const struct ray_field *f, const struct ray_kernel *k, const struct ray_pixel *p,
                  const struct ray_pixel *q, int a, float *weight)
{
    const float offset = ray_field_offset(f, p, q, a), across = ray_weight_x(k, a, offset),
                shift = k->shift[a] * offset;
    for (size_t j = 0; j < f->n_side; j++)
        weight[j] = across * ray_weight_y(k, a, ray_field_y(f, q, a, j) / f->half + shift);
}

/* The whole sum over the square that contains the neighbours of both axes. */
static struct ray_sum sum_whole(const struct ray_field *f, const struct ray_kernel *k, size_t i)
{
    const struct ray_pixel *p = &f->pixel[i];
    const long x = (long)(i % f->width), y = (long)(i / f->width);
    struct ray_sum sum = {0};
    for (long v = y - RAY_REACH; v <= y + RAY_REACH; v++)
        for (long u = x - RAY_REACH; u <= x + RAY_REACH; u++) {
            float first[RAY_MAX_SIDE], second[RAY_MAX_SIDE];
            if (u < 0 || v < 0 || u >= (long)f->width || v >= (long)f->height) continue;
            const size_t at = (size_t)v * f->width + (size_t)u;
            const struct ray_pixel *q = &f->pixel[at];
            if (at != i && !ray_pixel_near(p, q)) continue;
            weigh(f, k, p, q, 0, first);
            weigh(f, k, p, q, 1, second);
            for (size_t j2 = 0; j2 < f->n_side; j2++)
                for (size_t j1 = 0; j1 < f->n_side; j1++)
                    ray_sum_ray(&sum, f, first[j1] * second[j2] * ray_field_weight(f, q, j1, j2),
                                ray_field_value(f, at, j1, j2));
        }
    return sum;
}

/* A Gaussian mean along one axis. */
static struct ray_sum sum_axis(const struct run *r, const struct ray_sum *from, size_t i, int axis)
{
    const struct ray_field *f = r->f;
    struct ray_kernel k;
    struct ray_sum sum = {0};
    if (!ray_kernel_at(f, &f->pixel[i], true, &k)) return from[i];
    for (int offset = -RAY_REACH; offset <= RAY_REACH; offset++) {
        const size_t at = ray_neighbour(f, i, axis, offset);
        if (at == SIZE_MAX) continue;
        ray_sum_add(&sum, ray_weight_x(&k, axis, ray_field_offset(f, &f->pixel[i], &f->pixel[at], axis)), &from[at]);
    }
    return sum;
}

static void run_first(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    for (size_t i = y * r->f->width; i < (y + 1) * r->f->width && !progress_cancelled(r->progress); i++)
        r->first[i] = ray_sum_own(r->f, i);
}

static void run_second(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    for (size_t i = y * r->f->width; i < (y + 1) * r->f->width && !progress_cancelled(r->progress); i++)
        r->second[i] = sum_axis(r, r->first, i, 0);
}

static void run_last(void *context, size_t y, size_t i_thread)
{
    (void)i_thread;
    const struct run *r = context;
    for (size_t i = y * r->f->width; i < (y + 1) * r->f->width && !progress_cancelled(r->progress); i++) {
        struct ray_sum sum = {0};
        struct ray_kernel k;
        if (r->way == RAY_WHOLE && ray_kernel_at(r->f, &r->f->pixel[i], false, &k)) sum = sum_whole(r->f, &k, i);
        if (r->way == RAY_AXIS) sum = sum_axis(r, r->second, i, 1);
        ray_sum_mean(r->f, i, &sum, r->mean);
    }
}

status ray_filter(const struct ray_field *f, enum ray_filter_way way, struct thread_pool *pool,
                  const struct progress *progress, float *mean, struct error *err)
{
    struct run r = {.f = f, .way = way, .progress = progress, .mean = mean};
    const size_t n = f->width * f->height;
    status s = STATUS_OK;
    if (way == RAY_PASSES) return ray_filter_passes(f, pool, progress, mean, err);
    if (way == RAY_AXIS) {
        r.first = malloc(n * sizeof *r.first);
        r.second = malloc(n * sizeof *r.second);
        if (r.first == NULL || r.second == NULL)
            s = error_set(err, STATUS_NO_MEMORY, "cannot filter a picture: out of memory");
        if (s == STATUS_OK) s = thread_pool_run(pool, f->height, run_first, &r, NULL);
        if (s == STATUS_OK) s = thread_pool_run(pool, f->height, run_second, &r, NULL);
    }
    if (s == STATUS_OK) s = thread_pool_run(pool, f->height, run_last, &r, progress);
    if (s == STATUS_OK && progress_cancelled(progress)) s = STATUS_CANCELLED;
    if (s == STATUS_CANCELLED) error_set(err, s, "filtering a picture was cancelled");
    free(r.first);
    free(r.second);
    return s;
}
