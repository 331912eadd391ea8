#include "geometry/diameter/scale_space.h"

#include <string.h>

enum { MAX_REACH = 40 };

static void add_scaled(float *restrict to, const float *restrict from, float w, size_t n)
{
    for (size_t i = 0; i < n; i++) to[i] += w * from[i];
}

/* Convolves rows of n values, at most SCALE_EDGE, with edge values repeated. */
static void blur_rows(const float *in, float *out, size_t n, size_t n_row, const float *kernel, int reach)
{
    float padded[SCALE_EDGE + 2 * MAX_REACH];
    size_t before = (size_t)reach;
    memset(out, 0, n * n_row * sizeof *out);
    for (size_t k = 0; k < n_row; k++, in += n, out += n) {
        for (size_t i = 0; i < before; i++) {
            padded[i] = in[0];
            padded[before + n + i] = in[n - 1];
        }
        memcpy(padded + before, in, n * sizeof *in);
        for (size_t t = 0; t <= 2 * before; t++) add_scaled(out, padded + t, kernel[t], n);
    }
}

/* Convolves across n_line lines of n_inner neighbouring values, with edge lines repeated; n_outer such blocks. */
static void blur_lines(const float *in, float *out, size_t n_inner, size_t n_line, size_t n_outer, const float *kernel,
                       int reach)
{
    ptrdiff_t last = (ptrdiff_t)n_line - 1;
    memset(out, 0, n_inner * n_line * n_outer * sizeof *out);
    for (size_t o = 0; o < n_outer; o++, in += n_inner * n_line, out += n_inner * n_line)
        for (ptrdiff_t c = 0; c <= last; c++)
            for (int t = -reach; t <= reach; t++) {
                ptrdiff_t s = c + t < 0 ? 0 : c + t > last ? last : c + t;
                add_scaled(out + (size_t)c * n_inner, in + (size_t)s * n_inner, kernel[t + reach], n_inner);
            }
}

void scale_blur(float *a, float *b, const size_t n[3], double sigma)
{
    float kernel[2 * MAX_REACH + 1];
    int reach = (int)ceil(3.5 * sigma);
    if (reach < 1) reach = 1;
    double sum = 0.0;
    for (int t = -reach; t <= reach; t++) sum += exp(-0.5 * t * t / (sigma * sigma));
    for (int t = -reach; t <= reach; t++) kernel[t + reach] = (float)(exp(-0.5 * t * t / (sigma * sigma)) / sum);
    blur_rows(a, b, n[0], n[1] * n[2], kernel, reach);
    blur_lines(b, a, n[0], n[1], n[2], kernel, reach);
    blur_lines(a, b, n[0] * n[1], n[2], 1, kernel, reach);
    memcpy(a, b, n[0] * n[1] * n[2] * sizeof *a);
}

void scale_blur_on(float *a, float *b, const size_t n[3], int i)
{
    double sigma = scale_sigma(i), done = i > 0 ? scale_sigma(i - 1) : 0.0;
    scale_blur(a, b, n, sqrt(sigma * sigma - done * done));
}
