#include "optimizer/report/surface/surface_difference.h"

#include <math.h>
#include <stdbool.h>

enum { FIELD = 4, N_RGB = 3 };

/* Means over some pixels of both pictures, of their difference, and the variance of the difference. */
struct means {
    double reference[N_RGB], difference[N_RGB], variance[N_RGB];
    bool lit;
};

/* A variance; 0 for one that is not known. */
static double known(float variance) { return isnan(variance) ? 0.0 : (double)variance; }

static struct means means_of(const struct image *a, const struct image *b, size_t x0, size_t y0, size_t width,
                             size_t height)
{
    struct means m = {.lit = false};
    double n = (double)(width * height);
    for (size_t y = y0; y < y0 + height; y++)
        for (size_t x = x0; x < x0 + width; x++)
            for (size_t k = 0; k < N_RGB; k++) {
                const float *p = a->pixel + (y * a->width + x) * a->n_channel + k;
                const float *q = b->pixel + (y * b->width + x) * b->n_channel + k;
                m.reference[k] += (double)q[0] / n;
                m.difference[k] += ((double)p[0] - (double)q[0]) / n;
                m.variance[k] += (known(p[N_RGB]) + known(q[N_RGB])) / (n * n);
                m.lit = m.lit || p[0] > 0.0f || q[0] > 0.0f;
            }
    return m;
}

static double brightness(const struct means *m)
{
    return (m->reference[0] + m->reference[1] + m->reference[2]) / N_RGB;
}

void surface_difference_of(const struct image *picture, const struct image *reference, struct surface_difference *out)
{
    double sum_brightness = 0.0, sum_square = 0.0, sum_variance = 0.0;
    size_t n_lit = 0;
    for (size_t y = 0; y + FIELD <= picture->height; y += FIELD)
        for (size_t x = 0; x + FIELD <= picture->width; x += FIELD) {
            struct means m = means_of(picture, reference, x, y, FIELD, FIELD);
            if (!m.lit) continue;
            n_lit++;
            sum_brightness += brightness(&m);
            for (size_t k = 0; k < N_RGB; k++) {
                sum_square += m.difference[k] * m.difference[k];
                sum_variance += m.variance[k];
            }
        }
    double unit = sum_brightness / (double)n_lit, n = (double)(N_RGB * n_lit);
    if (!(unit > 0.0)) unit = NAN;
    out->field_noise = sqrt(sum_variance / n) / unit;
    out->field_rms = sqrt(fmax(sum_square - sum_variance, 0.0) / n) / unit;
    struct means whole = means_of(picture, reference, 0, 0, picture->width, picture->height);
    double whole_unit = brightness(&whole);
    if (!(whole_unit > 0.0)) whole_unit = NAN;
    for (size_t k = 0; k < N_RGB; k++) {
        out->mean[k] = whole.difference[k] / whole_unit;
        out->mean_se[k] = sqrt(whole.variance[k]) / whole_unit;
    }
}
