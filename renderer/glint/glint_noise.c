/* Slopes of surfaces with a Gaussian spectrum, and of grooves on such a surface. */
#include "base/rng.h"
#include "renderer/glint/fourier_grid.h"
#include "renderer/glint/glint_map.h"

#include <math.h>
#include <stdlib.h>

/* Signed frequency of bin k, in radians per texel. */
static double frequency(size_t k, size_t n)
{
    return 2 * M_PI * (k < n / 2 ? (double)k : (double)k - (double)n) / (double)n;
}

static void white_noise(uint64_t seed, size_t n, double (*value)[2])
{
    const struct rng_key key = {.seed = seed};
    for (size_t y = 0; y < n; y++) {
        struct rng r;
        rng_start(&r, &key, (uint32_t)y, 0);
        for (size_t x = 0; x < n; x += 2) {
            double pair[2];
            rng_normal_pair(&r, pair);
            for (size_t i = 0; i < 2; i++) {
                value[y * n + x + i][0] = pair[i];
                value[y * n + x + i][1] = 0;
            }
        }
    }
}

/* Turns the spectrum H of a height into (i ku H) + i (i kv H), whose transform has both slopes as its real and its
 * imaginary part. A correlation exp(-(x / l)^2) has the amplitudes exp(-(k l)^2 / 8). */
static void filter(const struct glint_option *o, size_t n, double (*value)[2])
{
    const double l[2] = {(double)(o->length_um[0] / o->texel_um), (double)(o->length_um[1] / o->texel_um)};
    for (size_t y = 0; y < n; y++)
        for (size_t x = 0; x < n; x++) {
            const double ku = frequency(x, n), kv = frequency(y, n);
            const double amplitude = exp(-(ku * ku * l[0] * l[0] + kv * kv * l[1] * l[1]) / 8);
            double *v = value[y * n + x];
            const double re = v[0] * amplitude, im = v[1] * amplitude;
            v[0] = -kv * re - ku * im;
            v[1] = ku * re - kv * im;
        }
}

status glint_noise_slopes(const struct glint_option *o, double slope, struct glint_map *m, struct error *err)
{
    const size_t n = m->n;
    double(*value)[2] = malloc(n * n * sizeof *value), square = 0;
    if (value == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a normal map: out of memory");
    white_noise(o->seed, n, value);
    status s = fourier_grid_transform(value, n, -1, err);
    if (s == STATUS_OK) {
        filter(o, n, value);
        s = fourier_grid_transform(value, n, 1, err);
    }
    for (size_t k = 0; s == STATUS_OK && k < n * n; k++)
        square += value[k][0] * value[k][0] + value[k][1] * value[k][1];
    const double scale = square > 0 ? slope / sqrt(square / (double)(n * n)) : 0;
    for (size_t k = 0; s == STATUS_OK && k < n * n; k++)
        for (int c = 0; c < 2; c++) m->normal[k][c] = (float)(value[k][c] * scale);
    free(value);
    return s;
}

/* A groove: a straight piece of a surface h = -depth exp(-x^2 / (2 width^2)) across its axis, in texels. */
struct groove {
    double middle[2], along[2], length, width, slope;
};

static struct groove groove_draw(struct rng *r, const struct glint_option *o, size_t n)
{
    struct groove g;
    for (int a = 0; a < 2; a++) g.middle[a] = rng_double(r) * (double)n;
    const double turn = rng_double(r) * M_PI;
    g.along[0] = cos(turn);
    g.along[1] = sin(turn);
    g.length = (0.25 + 0.5 * rng_double(r)) * (double)n;
    g.width = 1.5 + 1.5 * rng_double(r);
    g.slope = (double)o->slope * (0.5 + rng_double(r)) * exp(0.5);
    return g;
}

/* Adds the slopes of a groove to the texels within four widths of it; its ends run out over as much. */
static void groove_add(const struct groove *g, struct glint_map *m)
{
    const double reach = 4 * g->width;
    double half[2];
    for (int a = 0; a < 2; a++) half[a] = fabs(g->along[a]) * g->length / 2 + reach;
    for (double y = floor(g->middle[1] - half[1]); y <= g->middle[1] + half[1]; y++)
        for (double x = floor(g->middle[0] - half[0]); x <= g->middle[0] + half[0]; x++) {
            const double d[2] = {x + 0.5 - g->middle[0], y + 0.5 - g->middle[1]};
            const double along = d[0] * g->along[0] + d[1] * g->along[1];
            const double across = (d[1] * g->along[0] - d[0] * g->along[1]) / g->width;
            const double beyond = fmax(fabs(along) - g->length / 2, 0) / g->width;
            if (fabs(across) > 4 || beyond > 4) continue;
            const double p = g->slope * across * exp(-(across * across + beyond * beyond) / 2);
            const size_t i = (size_t)(int64_t)x & (m->n - 1), j = (size_t)(int64_t)y & (m->n - 1);
            m->normal[j * m->n + i][0] -= (float)(p * g->along[1]);
            m->normal[j * m->n + i][1] += (float)(p * g->along[0]);
        }
}

status glint_scratch_slopes(const struct glint_option *o, struct glint_map *m, struct error *err)
{
    const struct rng_key key = {.seed = o->seed, .iteration = 1};
    const double area = (double)m->n * (double)m->n * (double)o->scratch_share;
    struct rng r;
    /* the surface between grooves is smoother than they are */
    const status s = glint_noise_slopes(o, 0.1 * (double)o->slope, m, err);
    if (s != STATUS_OK) return s;
    rng_start(&r, &key, 0, 0);
    for (double covered = 0; covered < area;) {
        const struct groove g = groove_draw(&r, o, m->n);
        groove_add(&g, m);
        covered += g.length * 4 * g.width;
    }
    return STATUS_OK;
}
