#include "optimizer/photographs/rows/brdf_warp.h"

#include <math.h>

/* The sample below a place of rising samples, and the share of the next one. */
static size_t below(const double *axis, size_t n, double place, double *share)
{
    size_t i = 0;
    while (i + 2 < n && axis[i + 1] <= place) i++;
    *share = n < 2 ? 0.0 : fmin(fmax((place - axis[i]) / (axis[i + 1] - axis[i]), 0.0), 1.0);
    return i;
}

void warp_mix_at(const struct warp_axes *a, double phi_rad, double theta_rad, struct warp_mix *mix)
{
    double share[2];
    size_t p = below(a->phi_rad, a->n_phi, phi_rad, &share[0]);
    size_t t = below(a->theta_rad, a->n_theta, theta_rad, &share[1]);
    for (size_t k = 0; k < 4; k++) {
        size_t next_p = k & 1, next_t = k >> 1;
        mix->weight[k] = (next_p ? share[0] : 1.0 - share[0]) * (next_t ? share[1] : 1.0 - share[1]);
        size_t i_p = p + next_p < a->n_phi ? p + next_p : p, i_t = t + next_t < a->n_theta ? t + next_t : t;
        mix->slice[k] = i_p * a->n_theta + i_t;
    }
}

static double sample(const struct warp_table *t, const struct warp_mix *mix, size_t x, size_t y)
{
    double sum = 0.0;
    if (mix == NULL) return (double)t->value[y * t->width + x];
    for (size_t k = 0; k < 4; k++)
        if (mix->weight[k] > 0.0)
            sum += mix->weight[k] * (double)t->value[(mix->slice[k] * t->height + y) * t->width + x];
    return sum;
}

/* The cell of n samples that holds u, and the place in it. */
static size_t cell(double u, size_t n, double *share)
{
    double at = fmin(fmax(u, 0.0), 1.0) * (double)(n - 1);
    size_t i = (size_t)at < n - 2 ? (size_t)at : n - 2;
    *share = at - (double)i;
    return i;
}

double warp_table_value(const struct warp_table *t, const struct warp_mix *mix, const double u[2])
{
    double fx, fy;
    size_t x = cell(u[0], t->width, &fx), y = cell(u[1], t->height, &fy);
    double low = (1.0 - fx) * sample(t, mix, x, y) + fx * sample(t, mix, x + 1, y);
    double high = (1.0 - fx) * sample(t, mix, x, y + 1) + fx * sample(t, mix, x + 1, y + 1);
    return (1.0 - fy) * low + fy * high;
}

/* Integral along a row, in units of a cell. */
static double row_sum(const struct warp_table *t, const struct warp_mix *mix, size_t y)
{
    double sum = 0.0;
    for (size_t x = 0; x < t->width; x++) sum += (x == 0 || x == t->width - 1 ? 0.5 : 1.0) * sample(t, mix, x, y);
    return sum;
}

void warp_table_normalize(struct warp_table *t)
{
    size_t n = t->width * t->height;
    for (size_t s = 0; s < t->n_slice; s++) {
        struct warp_table one = {t->width, t->height, 1, t->value + s * n};
        double sum = 0.0;
        for (size_t y = 0; y < t->height; y++)
            sum += (y == 0 || y == t->height - 1 ? 0.5 : 1.0) * row_sum(&one, NULL, y);
        sum /= (double)((t->width - 1) * (t->height - 1));
        for (size_t i = 0; i < n; i++) one.value[i] = sum > 0.0 ? (float)((double)one.value[i] / sum) : 1.0f;
    }
}

/* Share of the integral of a piecewise linear density below a place; u where the density is 0. */
struct integral {
    double below, all, last;
};

static void integral_add(struct integral *n, size_t i, size_t i_cell, double share, double value)
{
    double step = i == 0 ? 0.0 : 0.5 * (n->last + value);
    if (i > 0 && i - 1 < i_cell) n->below += step;
    if (i > 0 && i - 1 == i_cell) n->below += share * (n->last + 0.5 * share * (value - n->last));
    n->all += step;
    n->last = value;
}

void warp_table_invert(const struct warp_table *t, const struct warp_mix *mix, const double u[2], double out[2])
{
    double fx, fy;
    size_t x = cell(u[0], t->width, &fx), y = cell(u[1], t->height, &fy);
    struct integral across = {0}, up = {0};
    for (size_t i = 0; i < t->width; i++)
        integral_add(&across, i, x, fx, (1.0 - fy) * sample(t, mix, i, y) + fy * sample(t, mix, i, y + 1));
    for (size_t i = 0; i < t->height; i++) integral_add(&up, i, y, fy, row_sum(t, mix, i));
    out[0] = across.all > 0.0 ? across.below / across.all : u[0];
    out[1] = up.all > 0.0 ? up.below / up.all : u[1];
}
