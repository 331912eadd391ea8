/* Tables of azimuthal scattering that dielectric.v1 and elliptical.v1 share: where directions lie between nodes, and
 * densities over half a turn that azimuths are drawn with, piecewise linear between n + 1 nodes. */
#ifndef SELVEDGE_RENDERER_AZIMUTH_TABLE_H
#define SELVEDGE_RENDERER_AZIMUTH_TABLE_H

#include "renderer/scattering/fiber_direction.h"

#include <math.h>
#include <stddef.h>

static inline float table_mix(float a, float b, float t) { return a + t * (b - a); }

/* Index of x, at least 0, in a table of n + 1 nodes 0, 1, ... n: sets *i to the node before x and returns the fraction
 * beyond it. */
static inline float table_position(float x, int n, int *i)
{
    *i = x < (float)(n - 1) ? (int)x : n - 1;
    return fminf(x - (float)*i, 1);
}

/* Stretches u to [0, 1) within an interval that starts at 0. */
static inline float table_stretch(float u, float width) { return fminf(u / width, 0x1.fffffep-1f); }

/* Index of two directions in a table by cos th_d (n_row + 1 nodes) and by |ph| (n_phi + 1 nodes). */
struct azimuth_index {
    struct fiber_direction in, out;
    int row, column, out_row;
    float x, y, out_x; /* between rows, columns, and rows of th_d = th_o */
};

static inline struct azimuth_index azimuth_index_of(const float wi[3], const float wo[3], int n_row, int n_phi)
{
    struct azimuth_index g = {.in = fiber_direction_of(wi), .out = fiber_direction_of(wo)};
    float c = g.in.cos_theta + g.out.cos_theta, u = wi[0] + wo[0], cos_d = 0.5f * sqrtf(c * c + u * u);
    float a = g.in.azimuth[0] - g.out.azimuth[0], b = g.in.azimuth[1] - g.out.azimuth[1];
    float half_sine = 0.5f * sqrtf(a * a + b * b), /* sin(ph / 2) */
        half_cosine = sqrtf(0.5f * fiber_one_minus_cos_opposite(&g.in, &g.out));
    g.x = table_position(cos_d * (float)n_row, n_row, &g.row);
    g.y = table_position(2 * fiber_angle(half_sine, half_cosine) * (float)(n_phi / M_PI), n_phi, &g.column);
    g.out_x = table_position(g.out.cos_theta * (float)n_row, n_row, &g.out_row);
    return g;
}

/* Value at the index g between four corners: row and row + 1, each at column and column + 1. */
#define AZIMUTH_BILINEAR(corner, g, field)                                                                             \
    table_mix(table_mix((corner)[0]->field, (corner)[1]->field, (g)->y),                                               \
              table_mix((corner)[2]->field, (corner)[3]->field, (g)->y), (g)->x)

/* Probabilities of n modes from the energies of two rows, each [n][3], x between them: by the root of the sum of the
 * squares of the weighted channels. No mode gets less than `least`, because all carry derivatives. weight_rgb NULL: 1.
 */
static inline void azimuth_mode_probabilities(const float (*before)[3], const float (*after)[3], float x, int n,
                                              const float *weight_rgb, float least, float *p)
{
    float sum = 0;
    for (int k = 0; k < n; k++) {
        p[k] = 0;
        for (int c = 0; c < 3; c++) {
            float e = (weight_rgb != NULL ? weight_rgb[c] : 1) * table_mix(before[k][c], after[k][c], x);
            p[k] += e * e;
        }
        sum += p[k] = sqrtf(p[k]);
    }
    for (int k = 0; k < n; k++) {
        float share = sum > 0 ? p[k] / sum : 1.0f / (float)n;
        p[k] = least + (1 - (float)n * least) * share;
    }
}

/* Azimuth in [0, pi] with a density; below: its integral from 0 to each node. u in [0, 1). */
static inline float azimuth_draw(const float *density, const float *below, int n, float u)
{
    int low = 0, high = n;
    u *= below[n];
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (below[middle] <= u)
            low = middle;
        else
            high = middle;
    }
    /* the root t of d0 t + (d1 - d0) t^2 / 2 = the rest over the step */
    const float step = (float)(M_PI / n);
    float rest = fmaxf(u - below[low], 0) / step, bend = density[low + 1] - density[low];
    float t = 2 * rest / (density[low] + sqrtf(fmaxf(density[low] * density[low] + 2 * bend * rest, 0)));
    return ((float)low + fminf(t, 1)) * step;
}

/* Azimuth in [-pi, pi], x between the densities of two rows: a side, then one of the rows, each with its share. */
static inline float azimuth_draw_side(const float *density, const float *below, const float *next_density,
                                      const float *next_below, int n, float x, float u)
{
    float side = u < 0.5f ? 1 : -1;
    u = table_stretch(u < 0.5f ? u : u - 0.5f, 0.5f);
    if (u < x) return side * azimuth_draw(next_density, next_below, n, table_stretch(u, x));
    return side * azimuth_draw(density, below, n, table_stretch(u - x, 1 - x));
}

/* A density of integral 1 over [0, pi], with 98 % in proportion to values that are at least 0 and the rest uniform, so
 * that it is nowhere 0. */
static inline void azimuth_density(const double *value, int n, float *density, float *below)
{
    const double step = M_PI / n;
    double sum = 0, integral = 0;
    for (int j = 0; j <= n; j++) sum += value[j] * step * (j == 0 || j == n ? 0.5 : 1);
    double scale = sum > 1e-12 ? 0.98 / sum : 0, uniform = (1 - scale * sum) / M_PI;
    for (int j = 0; j <= n; j++) {
        density[j] = (float)(scale * value[j] + uniform);
        if (j > 0) integral += 0.5 * step * ((double)density[j - 1] + (double)density[j]);
        below[j] = (float)integral;
    }
}

#endif
