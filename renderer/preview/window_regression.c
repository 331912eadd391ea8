#include "renderer/preview/window_regression.h"

#include <math.h>
#include <string.h>

enum {
    K = REGRESSION_GUIDE,
    V = REGRESSION_VALUE,
    MARGIN = 2 * REGRESSION_REACH + 1, /* cells: windows that hold a pixel, and the next one for what lies between */
    EDGE = REGRESSION_TILE + 2 * MARGIN,
    N_SQUARE = K * (K + 1) / 2,
    N_MOMENT = K + V + N_SQUARE + K * V,
    LANE = 16 /* windows that are fitted together */
};
/* Added to the variances of the guides: functions stay flat where guides hardly vary. */
static const float ridge = 0.01f;

/* The part of the picture that a tile's windows reach, in cells, and its moments: means of the guides, of the values,
 * of products of guides, and of guides and values. */
struct region {
    size_t cell, x, y, width, height; /* x, y: of the first cell of the region among those of the picture */
    size_t stride;                    /* cells of a plane, rounded up to whole lanes */
    float *moment, *temporary, *row;
};

static size_t whole_lanes(size_t n) { return (n + LANE - 1) / LANE * LANE; }

size_t regression_scratch(void)
{
    return whole_lanes((size_t)EDGE * EDGE) * (N_MOMENT + 1) + (size_t)EDGE + REGRESSION_TILE;
}

static float *plane_of(const struct region *r, size_t k) { return r->moment + k * r->stride; }
static size_t lower(size_t a, size_t b) { return a < b ? a : b; }

/* The pixels of a window along a line of n. */
static size_t n_reached(size_t i, size_t n, size_t reach)
{
    return lower(i + reach, n - 1) - (i > reach ? i - reach : 0) + 1;
}

static void box_row(const float *from, float *to, size_t n, size_t reach)
{
    double sum = 0;
    for (size_t i = 0; i < n && i < reach; i++) sum += (double)from[i];
    for (size_t i = 0; i < n; i++) {
        if (i + reach < n) sum += (double)from[i + reach];
        if (i > reach) sum -= (double)from[i - reach - 1];
        to[i] = (float)(sum / (double)n_reached(i, n, reach));
    }
}

/* All columns at once, COLUMNS after COLUMNS. */
static void box_columns(const float *from, float *to, size_t width, size_t height, size_t reach)
{
    enum { COLUMNS = 64 };
    for (size_t x0 = 0; x0 < width; x0 += COLUMNS) {
        const size_t n = lower(COLUMNS, width - x0);
        double sum[COLUMNS] = {0};
        for (size_t y = 0; y < height && y < reach; y++)
            for (size_t x = 0; x < n; x++) sum[x] += (double)from[y * width + x0 + x];
        for (size_t y = 0; y < height; y++) {
            const double part = 1.0 / (double)n_reached(y, height, reach);
            if (y + reach < height)
                for (size_t x = 0; x < n; x++) sum[x] += (double)from[(y + reach) * width + x0 + x];
            if (y > reach)
                for (size_t x = 0; x < n; x++) sum[x] -= (double)from[(y - reach - 1) * width + x0 + x];
            for (size_t x = 0; x < n; x++) to[y * width + x0 + x] = (float)(sum[x] * part);
        }
    }
}

void regression_box(float *plane, size_t width, size_t height, size_t reach, float *temporary)
{
    for (size_t y = 0; y < height; y++) box_row(plane + y * width, temporary + y * width, width, reach);
    box_columns(temporary, plane, width, height, reach);
}

/* ---- moments ---- */

/* Adds the products of n pixels of two rows to their cells; b NULL: the pixels of one. */
static void add_products(const float *a, const float *b, size_t n, size_t cell, float *to)
{
    if (cell == 1 && b != NULL)
        for (size_t x = 0; x < n; x++) to[x] = a[x] * b[x];
    else if (cell == 1)
        memcpy(to, a, n * sizeof *to);
    else
        for (size_t x = 0; x < n; x += cell, to++)
            for (size_t k = x; k < lower(x + cell, n); k++) *to += a[k] * (b != NULL ? b[k] : 1);
}

/* Adds row py of the picture to row y of the region. */
static void add_row(const struct regression_input *in, const struct region *r, size_t py, size_t y)
{
    const size_t x0 = r->x * r->cell, n = lower((r->x + r->width) * r->cell, in->width) - x0;
    const float *row[K + V];
    float *to = r->moment + y * r->width;
    for (size_t k = 0; k < K; k++) row[k] = in->guide[k] + py * in->width + x0;
    for (size_t v = 0; v < V; v++) row[K + v] = in->value[v] + py * in->width + x0;
    for (size_t k = 0; k < K + V; k++, to += r->stride) add_products(row[k], NULL, n, r->cell, to);
    for (size_t j = 0; j < K; j++)
        for (size_t k = 0; k <= j; k++, to += r->stride) add_products(row[j], row[k], n, r->cell, to);
    for (size_t j = 0; j < K; j++)
        for (size_t v = 0; v < V; v++, to += r->stride) add_products(row[j], row[K + v], n, r->cell, to);
}

static void fill_moments(const struct regression_input *in, const struct region *r)
{
    const size_t c = r->cell;
    memset(r->moment, 0, N_MOMENT * r->stride * sizeof *r->moment);
    for (size_t y = 0; y < r->height; y++)
        for (size_t py = (r->y + y) * c; py < lower((r->y + y + 1) * c, in->height); py++) add_row(in, r, py, y);
    for (size_t k = 0; k < N_MOMENT; k++) {
        float *plane = plane_of(r, k);
        for (size_t i = 0; i < r->width * r->height && c > 1; i++) {
            const size_t px = (r->x + i % r->width) * c, py = (r->y + i / r->width) * c;
            plane[i] /= (float)(lower(c, in->width - px) * lower(c, in->height - py));
        }
        regression_box(plane, r->width, r->height, REGRESSION_REACH, r->temporary);
    }
}

/* ---- functions ---- */

/* Solves (L L^T) x = b for V right sides of LANE windows in place. */
static void solve(float l[K][K][LANE], float b[K][V][LANE])
{
    for (size_t i = 0; i < K; i++) {
        for (size_t j = 0; j < i; j++) {
            for (size_t k = 0; k < j; k++)
                for (size_t w = 0; w < LANE; w++) l[i][j][w] -= l[i][k][w] * l[j][k][w];
            for (size_t w = 0; w < LANE; w++) {
                l[i][j][w] *= l[j][j][w];
                l[i][i][w] -= l[i][j][w] * l[i][j][w];
            }
        }
        for (size_t w = 0; w < LANE; w++) l[i][i][w] = 1 / sqrtf(fmaxf(l[i][i][w], 1e-6f));
    }
    for (size_t i = 0; i < K; i++)
        for (size_t v = 0; v < V; v++) {
            for (size_t k = 0; k < i; k++)
                for (size_t w = 0; w < LANE; w++) b[i][v][w] -= l[i][k][w] * b[k][v][w];
            for (size_t w = 0; w < LANE; w++) b[i][v][w] *= l[i][i][w];
        }
    for (size_t i = K; i-- > 0;)
        for (size_t v = 0; v < V; v++) {
            for (size_t k = i + 1; k < K; k++)
                for (size_t w = 0; w < LANE; w++) b[i][v][w] -= l[k][i][w] * b[k][v][w];
            for (size_t w = 0; w < LANE; w++) b[i][v][w] *= l[i][i][w];
        }
}

/* Replaces the moments of LANE cells from cell i by the slopes of their windows, in the planes of products of guides
 * and values, and by the constants, in the planes of values. */
static void fit_windows(const struct region *r, size_t i)
{
    const size_t stride = r->stride;
    float *mean = r->moment + i, *value = mean + K * stride, *square = value + V * stride,
          *product = square + N_SQUARE * stride;
    float l[K][K][LANE], b[K][V][LANE];
    for (size_t j = 0; j < K; j++)
        for (size_t k = 0; k <= j; k++, square += stride)
            for (size_t w = 0; w < LANE; w++)
                l[j][k][w] = square[w] - mean[j * stride + w] * mean[k * stride + w] + (j == k ? ridge : 0);
    for (size_t j = 0; j < K; j++)
        for (size_t v = 0; v < V; v++)
            for (size_t w = 0; w < LANE; w++)
                b[j][v][w] = product[(j * V + v) * stride + w] - mean[j * stride + w] * value[v * stride + w];
    solve(l, b);
    for (size_t j = 0; j < K; j++)
        for (size_t v = 0; v < V; v++)
            for (size_t w = 0; w < LANE; w++) {
                product[(j * V + v) * stride + w] = b[j][v][w];
                value[v * stride + w] -= b[j][v][w] * mean[j * stride + w];
            }
}

/* ---- the tile ---- */

/* Where a pixel lies between the cells of a region, along one axis. */
struct between {
    size_t first;
    float part; /* of the next cell */
};

static struct between between_cells(size_t pixel, size_t cell, size_t first_cell, size_t n_cell)
{
    if (cell == 1) return (struct between){pixel - first_cell, 0};
    float at = ((float)pixel + 0.5f) / (float)cell - 0.5f - (float)first_cell;
    at = fminf(fmaxf(at, 0), (float)(n_cell - 1));
    const size_t i = (size_t)at;
    return (struct between){i, at - (float)i};
}

/* Adds a plane of the region, times a guide or 1, to n pixels of a row. */
static void add_plane(const struct region *r, const float *plane, struct between y, size_t x0, size_t n,
                      const float *guide, float *out)
{
    const float *line = plane + y.first * r->width;
    if (y.part > 0) {
        for (size_t x = 0; x < r->width; x++) r->row[x] = line[x] + y.part * (line[x + r->width] - line[x]);
        line = r->row;
    }
    if (r->cell == 1) {
        line += x0 - r->x;
        for (size_t x = 0; x < n; x++) out[x] += (guide != NULL ? guide[x] : 1) * line[x];
        return;
    }
    for (size_t x = 0; x < n; x++) {
        const struct between at = between_cells(x0 + x, r->cell, r->x, r->width);
        const size_t next = lower(at.first + 1, r->width - 1);
        const float value = line[at.first] + at.part * (line[next] - line[at.first]);
        out[x] += (guide != NULL ? guide[x] : 1) * value;
    }
}

void regression_tile(const struct regression_input *in, size_t cell, size_t x0, size_t y0, float *scratch,
                     float *const *out)
{
    const size_t across = (in->width + cell - 1) / cell, down = (in->height + cell - 1) / cell, first_x = x0 / cell,
                 first_y = y0 / cell, x1 = lower(x0 + REGRESSION_TILE * cell, in->width),
                 y1 = lower(y0 + REGRESSION_TILE * cell, in->height);
    struct region r = {
        .cell = cell, .x = first_x > MARGIN ? first_x - MARGIN : 0, .y = first_y > MARGIN ? first_y - MARGIN : 0};
    r.width = lower(first_x + REGRESSION_TILE + MARGIN, across) - r.x;
    r.height = lower(first_y + REGRESSION_TILE + MARGIN, down) - r.y;
    r.stride = whole_lanes(r.width * r.height);
    r.moment = scratch;
    r.temporary = scratch + N_MOMENT * r.stride;
    r.row = r.temporary + r.stride;
    const size_t first_product = K + V + N_SQUARE;
    fill_moments(in, &r);
    for (size_t i = 0; i < r.stride; i += LANE) fit_windows(&r, i);
    for (size_t v = 0; v < V; v++)
        regression_box(plane_of(&r, K + v), r.width, r.height, REGRESSION_REACH, r.temporary);
    for (size_t k = 0; k < K * V; k++)
        regression_box(plane_of(&r, first_product + k), r.width, r.height, REGRESSION_REACH, r.temporary);
    for (size_t y = y0; y < y1; y++)
        for (size_t v = 0; v < V; v++) {
            const struct between at = between_cells(y, cell, r.y, r.height);
            const size_t to = y * in->width + x0, n = x1 - x0;
            memset(out[v] + to, 0, n * sizeof *out[v]);
            add_plane(&r, plane_of(&r, K + v), at, x0, n, NULL, out[v] + to);
            for (size_t a = 0; a < K; a++)
                add_plane(&r, plane_of(&r, first_product + a * V + v), at, x0, n, in->guide[a] + to, out[v] + to);
        }
}
