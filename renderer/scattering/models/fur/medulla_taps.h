/* Reading the factors of the tables of the medulla between their nodes: cubics with continuous slopes (Catmull and
 * Rom). */
#ifndef SELVEDGE_RENDERER_MEDULLA_TAPS_H
#define SELVEDGE_RENDERER_MEDULLA_TAPS_H

#include "renderer/scattering/models/fur/medulla_grid.h"

#include <stdbool.h>
#include <stddef.h>

#define MEDULLA_LEAST_DENSITY 1e-6 /* cubics may go below 0 where a peak ends */

/* Weights of four nodes of a table for a place between them, and their slopes by the place. */
struct medulla_taps {
    int i[4];
    float w[4], d[4];
};

/* Place x in [0, n - 1]; beyond the ends of a table that is not periodic it goes on straight. */
static inline struct medulla_taps medulla_taps_at(double x, int n, bool periodic)
{
    struct medulla_taps k;
    int i = (int)fmin(floor(x), periodic ? n - 1 : n - 2);
    const float t = (float)(x - i), u = 1 - t;
    k.w[0] = -0.5f * t * u * u;
    k.w[1] = 1 + t * t * (1.5f * t - 2.5f);
    k.w[2] = 1 + u * u * (1.5f * u - 2.5f);
    k.w[3] = -0.5f * u * t * t;
    k.d[0] = -0.5f * u * (u - 2 * t);
    k.d[1] = t * (4.5f * t - 5);
    k.d[2] = -u * (4.5f * u - 5);
    k.d[3] = -0.5f * t * (2 * u - t);
    for (int j = 0; j < 4; j++) k.i[j] = periodic ? (i + j - 1 + n) % n : i + j - 1;
    for (int end = 0; end < 4 && !periodic; end += 3) { /* a node beyond an end: twice the last less the one before */
        int last = end == 0 ? 1 : 2, before = end == 0 ? 2 : 1;
        if (k.i[end] >= 0 && k.i[end] < n) continue;
        k.i[end] = k.i[last];
        k.w[last] += 2 * k.w[end];
        k.d[last] += 2 * k.d[end];
        k.w[before] -= k.w[end];
        k.d[before] -= k.d[end];
        k.w[end] = k.d[end] = 0;
    }
    return k;
}

/* Value of every column of a factor, and its slope by x when wanted. */
static inline void medulla_read_factor(const struct medulla_taps *k, const float *factor, int rank, float scale,
                                       float *value, float *d)
{
    const float *a = factor + k->i[0] * rank, *b = factor + k->i[1] * rank, *c = factor + k->i[2] * rank,
                *e = factor + k->i[3] * rank;
    for (int r = 0; r < rank; r++) value[r] = k->w[0] * a[r] + k->w[1] * b[r] + k->w[2] * c[r] + k->w[3] * e[r];
    for (int r = 0; r < rank && d != NULL; r++)
        d[r] = scale * (k->d[0] * a[r] + k->d[1] * b[r] + k->d[2] * c[r] + k->d[3] * e[r]);
}

/* Place in the axis of depths, and its slope. */
static inline struct medulla_taps medulla_depth_taps(double depth, float *slope)
{
    const double scale = (MEDULLA_N_DEPTH - 1) / log1p(MEDULLA_MOST_DEPTH);
    double bounded = fmin(fmax(depth, 0), MEDULLA_MOST_DEPTH);
    *slope = bounded == depth ? (float)(scale / (1 + depth)) : 0;
    return medulla_taps_at(scale * log1p(bounded), MEDULLA_N_DEPTH, false);
}

static inline struct medulla_taps medulla_g_taps(double g, float *slope)
{
    *slope = (float)((MEDULLA_N_G - 1) / MEDULLA_MOST_G);
    return medulla_taps_at(fmin(fmax(g, 0), MEDULLA_MOST_G) * (MEDULLA_N_G - 1) / MEDULLA_MOST_G, MEDULLA_N_G, false);
}

#endif
