#include "geometry/diameter/scale_space.h"

#include "base/lanes.h"

#include <string.h>

enum { MAX_REACH = 40 };

/* Sums n values of the lines `in`, each times its weight of the kernel: out[i] = sum_t kernel[t] in[t][i]. Sums stay in
 * registers. */
static void sum_lines(const float *const *in, const float *kernel, int n_tap, float *out, size_t n)
{
    size_t i = 0;
    for (; i + (size_t)(4 * LANES) <= n; i += (size_t)(4 * LANES)) {
        lanes sum[4] = {{0.0f}, {0.0f}, {0.0f}, {0.0f}};
        for (int t = 0; t < n_tap; t++)
            for (int l = 0; l < 4; l++) sum[l] += kernel[t] * *(const lanes *)(in[t] + i + l * LANES);
        for (int l = 0; l < 4; l++) *(lanes *)(out + i + l * LANES) = sum[l];
    }
    for (; i < n; i++) {
        float sum = 0.0f;
        for (int t = 0; t < n_tap; t++) sum += kernel[t] * in[t][i];
        out[i] = sum;
    }
}

/* Convolves rows of n values, at most SCALE_EDGE, with edge values repeated. */
static void blur_rows(const float *in, float *out, size_t n, size_t n_row, const float *kernel, int reach)
{
    float padded[SCALE_EDGE + 2 * MAX_REACH];
    const float *tap[2 * MAX_REACH + 1];
    size_t before = (size_t)reach;
    for (size_t t = 0; t <= 2 * before; t++) tap[t] = padded + t;
    for (size_t k = 0; k < n_row; k++, in += n, out += n) {
        for (size_t i = 0; i < before; i++) {
            padded[i] = in[0];
            padded[before + n + i] = in[n - 1];
        }
        memcpy(padded + before, in, n * sizeof *in);
        sum_lines(tap, kernel, 2 * reach + 1, out, n);
    }
}

/* Convolves across n_line lines of n_inner neighbouring values, with edge lines repeated; n_outer such blocks. */
static void blur_lines(const float *in, float *out, size_t n_inner, size_t n_line, size_t n_outer, const float *kernel,
                       int reach)
{
    const float *tap[2 * MAX_REACH + 1];
    ptrdiff_t last = (ptrdiff_t)n_line - 1;
    for (size_t o = 0; o < n_outer; o++, in += n_inner * n_line, out += n_inner * n_line)
        for (ptrdiff_t c = 0; c <= last; c++) {
            for (int t = -reach; t <= reach; t++) {
                ptrdiff_t s = c + t < 0 ? 0 : c + t > last ? last : c + t;
                tap[t + reach] = in + (size_t)s * n_inner;
            }
            sum_lines(tap, kernel, 2 * reach + 1, out + (size_t)c * n_inner, n_inner);
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
