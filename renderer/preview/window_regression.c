#include "renderer/preview/window_regression.h"

#include <math.h>
#include <string.h>

enum {
    K = REGRESSION_GUIDE,
    V = REGRESSION_VALUE,
    EDGE = REGRESSION_TILE + 4 * REGRESSION_MOST_REACH,
    N_SQUARE = K * (K + 1) / 2,
    N_MOMENT = K + V + N_SQUARE + K * V
};
/* Added to the variances of the guides: functions stay flat where guides hardly vary. */
static const float ridge = 0.01f;

/* The part of the picture that a tile's windows reach, and its moments: means of the guides, of the values, of products
 * of guides, and of guides and values. */
struct region {
    size_t x, y, width, height;
    float *moment, *temporary;
};

size_t regression_scratch(void) { return (size_t)EDGE * EDGE * (N_MOMENT + 1); }

static float *plane_of(const struct region *r, size_t k) { return r->moment + k * r->width * r->height; }

/* Means along one line of n values, `step` apart. */
static void box_line(const float *from, float *to, size_t n, size_t step, size_t reach)
{
    double sum = 0;
    for (size_t i = 0; i < n && i < reach; i++) sum += (double)from[i * step];
    for (size_t i = 0; i < n; i++) {
        if (i + reach < n) sum += (double)from[(i + reach) * step];
        if (i > reach) sum -= (double)from[(i - reach - 1) * step];
        const size_t first = i > reach ? i - reach : 0, last = i + reach < n ? i + reach : n - 1;
        to[i * step] = (float)(sum / (double)(last - first + 1));
    }
}

void regression_box(float *plane, size_t width, size_t height, size_t reach, float *temporary)
{
    for (size_t y = 0; y < height; y++) box_line(plane + y * width, temporary + y * width, width, 1, reach);
    for (size_t x = 0; x < width; x++) box_line(temporary + x, plane + x, height, width, reach);
}

static void fill_moments(const struct regression_input *in, const struct region *r, size_t reach)
{
    for (size_t y = 0; y < r->height; y++)
        for (size_t x = 0; x < r->width; x++) {
            const size_t from = (r->y + y) * in->width + r->x + x, to = y * r->width + x, stride = r->width * r->height;
            float g[K], *m = r->moment + to;
            for (size_t a = 0; a < K; a++, m += stride) *m = g[a] = in->guide[a][from];
            for (size_t v = 0; v < V; v++, m += stride) *m = in->value[v][from];
            for (size_t a = 0; a < K; a++)
                for (size_t b = 0; b <= a; b++, m += stride) *m = g[a] * g[b];
            for (size_t a = 0; a < K; a++)
                for (size_t v = 0; v < V; v++, m += stride) *m = g[a] * in->value[v][from];
        }
    for (size_t k = 0; k < N_MOMENT; k++) regression_box(plane_of(r, k), r->width, r->height, reach, r->temporary);
}

/* Solves (L L^T) x = b for V right sides in place. */
static void solve(float l[K][K], float b[K][V])
{
    for (size_t i = 0; i < K; i++)
        for (size_t j = 0; j <= i; j++) {
            float sum = l[i][j];
            for (size_t k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
            l[i][j] = i == j ? sqrtf(fmaxf(sum, 1e-6f)) : sum / l[j][j];
        }
    for (size_t i = 0; i < K; i++)
        for (size_t v = 0; v < V; v++) {
            for (size_t k = 0; k < i; k++) b[i][v] -= l[i][k] * b[k][v];
            b[i][v] /= l[i][i];
        }
    for (size_t i = K; i-- > 0;)
        for (size_t v = 0; v < V; v++) {
            for (size_t k = i + 1; k < K; k++) b[i][v] -= l[k][i] * b[k][v];
            b[i][v] /= l[i][i];
        }
}

/* Replaces the moments of pixel i by the slopes of its window, in the planes of products of guides and values, and by
 * the constants, in the planes of values. */
static void fit_window(const struct region *r, size_t i)
{
    const size_t stride = r->width * r->height;
    float *mean = r->moment + i, *value = mean + K * stride, *square = value + V * stride,
          *product = square + N_SQUARE * stride;
    float l[K][K], b[K][V];
    size_t at = 0;
    for (size_t j = 0; j < K; j++)
        for (size_t k = 0; k <= j; k++)
            l[j][k] = square[at++ * stride] - mean[j * stride] * mean[k * stride] + (j == k ? ridge : 0);
    for (size_t j = 0; j < K; j++)
        for (size_t v = 0; v < V; v++) b[j][v] = product[(j * V + v) * stride] - mean[j * stride] * value[v * stride];
    solve(l, b);
    for (size_t v = 0; v < V; v++)
        for (size_t j = 0; j < K; j++) {
            product[(j * V + v) * stride] = b[j][v];
            value[v * stride] -= b[j][v] * mean[j * stride];
        }
}

static size_t lower(size_t a, size_t b) { return a < b ? a : b; }

void regression_tile(const struct regression_input *in, size_t reach, size_t x0, size_t y0, float *scratch,
                     float *const *out)
{
    const size_t margin = 2 * reach, x1 = lower(x0 + REGRESSION_TILE, in->width),
                 y1 = lower(y0 + REGRESSION_TILE, in->height);
    struct region r = {.x = x0 > margin ? x0 - margin : 0, .y = y0 > margin ? y0 - margin : 0};
    r.width = lower(x1 + margin, in->width) - r.x;
    r.height = lower(y1 + margin, in->height) - r.y;
    r.moment = scratch;
    r.temporary = scratch + N_MOMENT * r.width * r.height;
    const size_t stride = r.width * r.height, first_product = K + V + N_SQUARE;
    fill_moments(in, &r, reach);
    for (size_t i = 0; i < stride; i++) fit_window(&r, i);
    for (size_t v = 0; v < V; v++) regression_box(plane_of(&r, K + v), r.width, r.height, reach, r.temporary);
    for (size_t k = 0; k < K * V; k++)
        regression_box(plane_of(&r, first_product + k), r.width, r.height, reach, r.temporary);
    for (size_t y = y0; y < y1; y++)
        for (size_t x = x0; x < x1; x++) {
            const size_t i = (y - r.y) * r.width + x - r.x, to = y * in->width + x;
            for (size_t v = 0; v < V; v++) {
                float sum = plane_of(&r, K + v)[i];
                for (size_t a = 0; a < K; a++) sum += in->guide[a][to] * plane_of(&r, first_product + a * V + v)[i];
                out[v][to] = sum;
            }
        }
}
