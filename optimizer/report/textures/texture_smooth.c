#include "optimizer/report/textures/texture_smooth.h"

#include "base/small_matrix.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { N_FEATURE = 9, N_RGB = 3 };

struct smoothing {
    const struct texture_maps *m;
    double sd_mm;
    size_t n;
    float *detail; /* n x N_FEATURE: features less their smoothed ones */
    float *room;   /* 2 n x N_FEATURE */
};

/* Heights in units of 50 um, so that all features are of about one magnitude. */
static void features_of(const struct texture_maps *m, size_t i, float f[N_FEATURE])
{
    const float *n = m->fiber_normal + 3 * i, h = m->height_mm[i] / 0.05f;
    const float all[N_FEATURE] = {h, h * h, n[0], n[1], n[2], n[0] * n[0], n[1] * n[1], h * n[2], m->cover[i]};
    memcpy(f, all, sizeof all);
}

static void find_detail(struct smoothing *s)
{
    float *smooth = s->room;
    for (size_t i = 0; i < s->n; i++) features_of(s->m, i, s->detail + i * N_FEATURE);
    memcpy(smooth, s->detail, s->n * N_FEATURE * sizeof *smooth);
    texture_maps_smooth(s->m, smooth, N_FEATURE, s->sd_mm, smooth + s->n * N_FEATURE);
    for (size_t i = 0; i < s->n * N_FEATURE; i++) s->detail[i] -= smooth[i];
}

/* Solves the normal equations; a part of the diagonal is added, so that features that do not vary are left out. False:
 * they have no solution. */
static bool solve(double a[N_FEATURE][N_FEATURE], double b[N_FEATURE][N_RGB])
{
    double most = 0.0;
    for (int k = 0; k < N_FEATURE; k++) most = fmax(most, a[k][k]);
    for (int k = 0; k < N_FEATURE; k++) a[k][k] += 1e-6 * most + 1e-30;
    if (!small_factor(&a[0][0], N_FEATURE, 0.0)) return false;
    for (int c = 0; c < N_RGB; c++) small_solve(&a[0][0], N_FEATURE, &b[0][c], N_RGB);
    return true;
}

/* rgb: light of one half, which becomes the smooth one. rest: what smoothing takes off. */
static void smooth_half(const struct smoothing *s, float *rgb, float *rest)
{
    double a[N_FEATURE][N_FEATURE] = {{0.0}}, b[N_FEATURE][N_RGB] = {{0.0}};
    memcpy(rest, rgb, s->n * N_RGB * sizeof *rest);
    texture_maps_smooth(s->m, rgb, N_RGB, s->sd_mm, s->room);
    for (size_t i = 0; i < s->n; i++) {
        const float *f = s->detail + i * N_FEATURE;
        for (int j = 0; j < N_FEATURE; j++) {
            for (int k = 0; k <= j; k++) a[j][k] += (double)f[j] * (double)f[k];
            for (size_t c = 0; c < N_RGB; c++)
                b[j][c] += (double)f[j] * (double)(rest[i * N_RGB + c] - rgb[i * N_RGB + c]);
        }
    }
    if (!solve(a, b)) return; /* without what the features explain */
    for (size_t i = 0; i < s->n; i++)
        for (size_t c = 0; c < N_RGB; c++) {
            double value = (double)rgb[i * N_RGB + c];
            for (int k = 0; k < N_FEATURE; k++) value += b[k][c] * (double)s->detail[i * N_FEATURE + (size_t)k];
            rgb[i * N_RGB + c] = (float)value;
        }
}

static double noise_of(const float *a, const float *b, struct image *out)
{
    double difference = 0.0, square = 0.0;
    for (size_t i = 0; i < out->width * out->height * N_RGB; i++) {
        const double mean = 0.5 * ((double)a[i] + (double)b[i]), d = 0.5 * ((double)a[i] - (double)b[i]);
        out->pixel[i] = (float)fmax(mean, 0.0);
        difference += d * d;
        square += mean * mean;
    }
    return square > 0.0 ? sqrt(difference / square) : 0.0;
}

status texture_smooth(const struct texture_maps *m, const struct image half[2], double sd_mm, struct image *out,
                      double *noise, struct error *err)
{
    struct smoothing s = {.m = m, .sd_mm = sd_mm, .n = m->width * m->height};
    s.detail = calloc(s.n * N_FEATURE, sizeof *s.detail);
    s.room = calloc(2 * s.n * N_FEATURE, sizeof *s.room);
    float *rgb = calloc(3 * s.n * N_RGB, sizeof *rgb), *rest = rgb + 2 * s.n * N_RGB;
    const bool whole = s.detail != NULL && s.room != NULL && rgb != NULL;
    if (whole && sd_mm > 0.0) find_detail(&s);
    for (size_t h = 0; h < 2 && whole; h++) {
        float *own = rgb + h * s.n * N_RGB;
        for (size_t i = 0; i < s.n; i++)
            memcpy(own + i * N_RGB, half[h].pixel + i * half[h].n_channel, N_RGB * sizeof *own);
        if (sd_mm > 0.0) smooth_half(&s, own, rest);
    }
    if (whole) *noise = noise_of(rgb, rgb + s.n * N_RGB, out);
    free(s.detail);
    free(s.room);
    free(rgb);
    return whole ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot smooth textures: out of memory");
}
