#include "tests/support/weave/drawn_weave.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* A reproducible number in [0, 1) of a place and a seed. */
static double hash_uniform(uint64_t a, uint64_t b, uint64_t seed)
{
    uint64_t h = a * 0x9e3779b97f4a7c15u + b * 0xc2b2ae3d27d4eb4fu + seed * 0x165667b19e3779f9u;
    for (int i = 0; i < 3; i++) {
        h ^= h >> 31;
        h *= 0xbf58476d1ce4e5b9u;
    }
    return (double)((h ^ h >> 29) >> 11) / 9007199254740992.0;
}

static double hash_normal(uint64_t a, uint64_t b, uint64_t seed)
{
    double u = hash_uniform(a, b, seed), v = hash_uniform(b, a + 1, seed + 1);
    return sqrt(-2.0 * log(u + 1e-12)) * cos(2.0 * M_PI * v);
}

void drawn_weave_size(const char *rows, size_t size[2])
{
    size[0] = strcspn(rows, "/");
    size[1] = 1;
    for (const char *c = rows; *c != '\0'; c++) size[1] += *c == '/';
}

static bool warp_on_top(const struct drawn_weave *w, const size_t size[2], long i, long j)
{
    size_t column = (size_t)((i % (long)size[0] + (long)size[0]) % (long)size[0]);
    size_t row = (size_t)((j % (long)size[1] + (long)size[1]) % (long)size[1]);
    return w->rows[row * (size[0] + 1) + column] == '#';
}

/* Brightness of a cylinder across, and of its bow along a float. */
static double shade(const struct drawn_weave *w, double across, double along)
{
    double x = 2.0 * across / w->cover;
    return fabs(x) >= 1.0 ? 0.05 : (0.15 + 0.85 * sqrt(1.0 - x * x)) * (0.7 + 0.3 * sin(M_PI * along));
}

static void cylinder_color(const struct drawn_weave *w, const size_t size[2], double u, double v, double rgb[3])
{
    long i = lround(u), j = lround(v), before = 0, after = 0;
    bool warp = warp_on_top(w, size, i, j);
    while (before < 16 && warp_on_top(w, size, warp ? i : i - before - 1, warp ? j - before - 1 : j) == warp) before++;
    while (after < 16 && warp_on_top(w, size, warp ? i : i + after + 1, warp ? j + after + 1 : j) == warp) after++;
    double across = warp ? u - (double)i : v - (double)j, along = warp ? v - (double)j : u - (double)i;
    double light = shade(w, across, (along + 0.5 + (double)before) / (double)(before + after + 1));
    double yarn = 1.0 + w->unevenness * hash_normal((uint64_t)(warp ? i : j) + 1000, warp ? 1 : 2, w->seed);
    for (int c = 0; c < 3; c++) rgb[c] = light * fmax(0.1, yarn) * (warp ? w->warp_rgb[c] : w->weft_rgb[c]);
}

/* The tile is periodic; its row 0 is the picture's top. */
static void tile_color(const struct drawn_weave *w, const size_t size[2], double u, double v, double rgb[3])
{
    (void)size; /* the tile has the draft */
    double at[2] = {u / (double)w->tile_yarns[0], v / (double)w->tile_yarns[1]};
    size_t k[2];
    for (int a = 0; a < 2; a++) k[a] = (size_t)((at[a] - floor(at[a])) * (double)w->tile_size[a]) % w->tile_size[a];
    double grey = pow((double)w->tile[k[1] * w->tile_size[0] + k[0]] / 255.0, 2.0);
    double yarn = 1.0 + 0.5 * w->unevenness *
                            (hash_normal((uint64_t)(lround(u) + 1000), 1, w->seed) +
                             hash_normal((uint64_t)(lround(v) + 1000), 2, w->seed));
    for (int c = 0; c < 3; c++) rgb[c] = grey * fmax(0.1, yarn) * w->warp_rgb[c];
}

static void pixel_color(const struct drawn_weave *w, const size_t size[2], double x, double y, double rgb[3])
{
    enum { SUB = 2 };
    double angle = w->rotation_deg * M_PI / 180.0, middle = 0.5 * (double)w->edge_px;
    for (int c = 0; c < 3; c++) rgb[c] = 0.0;
    for (int s = 0; s < SUB * SUB; s++) {
        double p = x + (s % SUB + 0.5) / SUB - middle, q = y + (s / SUB + 0.5) / SUB - middle, own[3];
        double u = (cos(angle) * p + sin(angle) * q) / w->spacing_px[0];
        double v = (cos(angle) * q - sin(angle) * p) / w->spacing_px[1];
        (w->tile != NULL ? tile_color : cylinder_color)(w, size, u, v, own);
        for (int c = 0; c < 3; c++) rgb[c] += own[c] / (SUB * SUB);
    }
}

float *drawn_weave_picture(const struct drawn_weave *w)
{
    size_t n = w->edge_px;
    double mean = 0.0;
    size_t size[2] = {1, 1};
    if (w->tile == NULL) drawn_weave_size(w->rows, size);
    float *rgb = malloc(3 * n * n * sizeof *rgb);
    if (rgb == NULL) abort();
    for (size_t y = 0; y < n; y++)
        for (size_t x = 0; x < n; x++) {
            double color[3], light = 1.0 + w->gradient * (1.0 - (double)x / (double)n);
            pixel_color(w, size, (double)x, (double)y, color);
            if (hypot((double)x, (double)(n - y)) < w->dark_corner_px) light = 0.0;
            for (size_t c = 0; c < 3; c++) {
                rgb[3 * (y * n + x) + c] = (float)(color[c] * light);
                mean += color[c] * light / (double)(3 * n * n);
            }
        }
    for (size_t i = 0; i < 3 * n * n; i++) rgb[i] += (float)(w->noise * mean * hash_normal(i, 7, w->seed));
    return rgb;
}
