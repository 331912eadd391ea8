#include "tests/bench/pictures/field_comparison.h"

#include <math.h>

/* Mean and variance of the mean of each channel. */
static void field_of(const struct image *im, size_t x, size_t y, size_t edge, double mean[3], double var[3])
{
    double n = (double)(edge * edge);
    for (int c = 0; c < 3; c++) mean[c] = var[c] = 0.0;
    for (size_t k = 0; k < edge * edge; k++) {
        const float *p = im->pixel + ((y * edge + k / edge) * im->width + x * edge + k % edge) * im->n_channel;
        for (int c = 0; c < 3; c++) {
            mean[c] += (double)p[c] / n;
            var[c] += (double)p[3 + c] / (n * n);
        }
    }
}

struct field_comparison field_comparison_of(const struct image *first, const struct image *second, size_t edge)
{
    struct field_comparison r = {0};
    for (size_t y = 0; y < first->height / edge; y++)
        for (size_t x = 0; x < first->width / edge; x++) {
            double a[3], va[3], b[3], vb[3];
            field_of(first, x, y, edge, a, va);
            field_of(second, x, y, edge, b, vb);
            if (!(a[0] + a[1] + a[2] > 0.0) && !(b[0] + b[1] + b[2] > 0.0)) continue;
            double of_field = 0.0;
            for (int c = 0; c < 3; c++, r.n += 1.0) {
                r.mean += a[c];
                r.difference += b[c] - a[c];
                r.error2 += (b[c] - a[c]) * (b[c] - a[c]);
                r.noise2[0] += va[c];
                r.noise2[1] += vb[c];
                of_field += (b[c] - a[c]) * (b[c] - a[c]) - va[c] - vb[c];
            }
            r.square2 += of_field * of_field;
        }
    return r;
}

double field_comparison_stays(const struct field_comparison *r)
{
    return sqrt(fmax(0.0, r->error2 - r->noise2[0] - r->noise2[1]) * r->n) / r->mean;
}

double field_comparison_square_se(const struct field_comparison *r)
{
    double sum = r->error2 - r->noise2[0] - r->noise2[1], n_field = r->n / 3.0;
    return sqrt(fmax(0.0, r->square2 - sum * sum / n_field)) * r->n / (r->mean * r->mean);
}
