#include "renderer/glint/glint_draw.h"

#include <math.h>

void glint_normal_pair(const float u[2], float out[2])
{
    const float radius = sqrtf(-2 * logf(1 - u[0])), turn = 2 * (float)M_PI * u[1];
    out[0] = radius * cosf(turn);
    out[1] = radius * sinf(turn);
}

/* Adds L z to at, where L L^T is the matrix m = { uu, uv, vv }, at least 0. */
static void add_spread(const float m[3], const float z[2], float at[2])
{
    const float a = sqrtf(fmaxf(m[0], 0)), b = a > 0 ? m[1] / a : 0;
    at[0] += a * z[0];
    at[1] += b * z[0] + sqrtf(fmaxf(m[2] - b * b, 0)) * z[1];
}

/* Draws k with a probability proportional to exp(-(k + 1/2 - mean)^2 / (2 variance)) (1 + ripple cos(2 pi (turn + k
 * turn_step))). The numbers are in steps of the lattice. */
struct row_ripple {
    float ripple, turn, turn_step;
};

static float weight_at(float k, float mean, float variance, const struct row_ripple *r)
{
    const float d = k + 0.5F - mean, w = expf(-d * d / (2 * variance));
    return r == NULL ? w : w * (1 + r->ripple * cosf(2 * (float)M_PI * (r->turn + r->turn_step * (k + 0.5F - mean))));
}

static int64_t pick(float mean, float variance, const struct row_ripple *r, float u)
{
    const float reach = 4.5F * sqrtf(variance) + 1, first = floorf(mean - reach), last = floorf(mean + reach);
    float sum = 0;
    for (float k = first; k <= last; k++) sum += weight_at(k, mean, variance, r);
    float left = u * sum;
    for (float k = first; k < last; k++) {
        left -= weight_at(k, mean, variance, r);
        if (left < 0) return (int64_t)k;
    }
    return (int64_t)last;
}

/* A footprint of more than a step: a place of a Gaussian that is narrower by a step, and an element around it. A sum of
 * Gaussians as wide as their distance is the same everywhere, within 1e-8. */
static void pick_wide(const float place[2], const float c[3], const float u[4], int64_t at[2])
{
    const float narrower[3] = {c[0] - 1, c[1], c[2] - 1};
    float z[2], x[2] = {place[0], place[1]};
    glint_normal_pair(u, z);
    add_spread(narrower, z, x);
    for (int a = 0; a < 2; a++) at[a] = pick(x[a], 1, NULL, u[2 + a]);
}

/* Any footprint: a row by its whole weight, then an element of the row. The row's elements have the mean
 * place[0] + lean (v - place[1]); their sum ripples with the place of this mean between elements. */
static void pick_any(const float place[2], const float c[3], const float u[4], int64_t at[2])
{
    const float lean = c[1] / c[2], variance = fmaxf(c[0] - lean * c[1], 1e-6F);
    const struct row_ripple ripple = {2 * expf(-2 * (float)(M_PI * M_PI) * variance), place[0] - 0.5F, lean};
    at[1] = pick(place[1], c[2], &ripple, u[2]);
    at[0] = pick(place[0] + lean * ((float)at[1] + 0.5F - place[1]), variance, NULL, u[3]);
}

void glint_draw(const struct glint_lattice *l, const struct glint_query *q, const float u[GLINT_N_NUMBER],
                float half[2])
{
    const float h = l->step_um, place[2] = {q->center_um[0] / h, q->center_um[1] / h};
    const float c[3] = {q->wide[0] / (h * h), q->wide[1] / (h * h), q->wide[2] / (h * h)};
    const float mean = (c[0] + c[2]) / 2, off = sqrtf((c[0] - c[2]) * (c[0] - c[2]) / 4 + c[1] * c[1]);
    const int64_t mask = (int64_t)l->n - 1;
    int64_t at[2];
    if (mean - off >= 1)
        pick_wide(place, c, u, at);
    else
        pick_any(place, c, u, at);
    const float d[2] = {(place[0] - (float)at[0] - 0.5F) * h, (place[1] - (float)at[1] - 0.5F) * h};
    float z[2], covariance[3];
    glint_query_normal(q, &l->element[glint_lattice_index(l, (size_t)(at[0] & mask), (size_t)(at[1] & mask))], d, half,
                       covariance);
    glint_normal_pair(u + 4, z);
    add_spread(covariance, z, half);
}
