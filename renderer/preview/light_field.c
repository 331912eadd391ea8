#include "renderer/preview/light_field.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMOOTH = 2, MAX_EDGE = 1 << 14 };

status light_field_init(struct light_field *f, size_t width, size_t height, size_t n_side, struct error *err)
{
    *f = (struct light_field){.width = width, .height = height, .n_side = n_side};
    if (width == 0 || height == 0 || width > MAX_EDGE || height > MAX_EDGE || n_side == 0 ||
        n_side > LIGHT_FIELD_MAX_SIDE)
        return error_set(err, STATUS_INVALID,
                         "cannot sample a shadow of %zu x %zu places with %zu x %zu rays each: allowed are at most %d "
                         "places and %d rays a side",
                         width, height, n_side, n_side, MAX_EDGE, LIGHT_FIELD_MAX_SIDE);
    size_t n = width * height;
    f->lit = malloc(n * n_side * n_side);
    f->jitter = calloc(n, sizeof *f->jitter);
    f->slope = calloc(n, sizeof *f->slope);
    if (f->lit == NULL || f->jitter == NULL || f->slope == NULL) {
        light_field_release(f);
        return error_set(err, STATUS_NO_MEMORY, "cannot sample a shadow of %zu x %zu places: out of memory", width,
                         height);
    }
    memset(f->lit, 1, n * n_side * n_side);
    return STATUS_OK;
}

void light_field_release(struct light_field *f)
{
    free(f->lit);
    free(f->jitter);
    free(f->slope);
    memset(f, 0, sizeof *f);
}

double light_field_place_mm(const struct light_field *f, size_t i_receiver, int a, size_t i)
{
    double share = ((double)i + (double)f->jitter[i_receiver][a]) / (double)f->n_side;
    return (2.0 * share - 1.0) * f->half_side_mm;
}

void light_field_meet(struct light_field *f, size_t i_receiver, double slope)
{
    float *s = f->slope[i_receiver], v = (float)slope;
    if (!(v > 0)) return;
    s[0] = s[0] > 0 ? fminf(s[0], v) : v;
    s[1] = fmaxf(s[1], v);
}

static void mean_slopes(const struct light_field *f, long x, long y, float mean[2])
{
    float n = 0, sum[2] = {0, 0};
    for (long v = y - SMOOTH; v <= y + SMOOTH; v++)
        for (long u = x - SMOOTH; u <= x + SMOOTH; u++) {
            if (u < 0 || v < 0 || u >= (long)f->width || v >= (long)f->height) continue;
            const float *s = f->slope[v * (long)f->width + u];
            if (!(s[0] > 0)) continue;
            n++;
            for (int k = 0; k < 2; k++) sum[k] += s[k];
        }
    for (int k = 0; k < 2; k++) mean[k] = n > 0 ? sum[k] / n : 0;
}

status light_field_smooth_slopes(struct light_field *f, struct error *err)
{
    float(*smooth)[2] = malloc(f->width * f->height * sizeof *smooth);
    if (smooth == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot filter a shadow: out of memory");
    for (size_t y = 0; y < f->height; y++)
        for (size_t x = 0; x < f->width; x++) mean_slopes(f, (long)x, (long)y, smooth[y * f->width + x]);
    free(f->slope);
    f->slope = smooth;
    return STATUS_OK;
}
