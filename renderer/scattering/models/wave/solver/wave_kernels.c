#include "renderer/scattering/models/wave/solver/wave_kernels.h"

#include "renderer/scattering/models/wave/solver/complex_parts.h"
#include "renderer/scattering/models/wave/solver/cylinder_functions.h"

#include <math.h>
#include <stdlib.h>

#define EULER 0.57721566490153286061
#define MOST_ABSORPTION 20.0 /* of Im(k m) times a distance: the range of the cylinder functions */

double complex wave_direction(double angle_rad) { return complex_of(cos(angle_rad), sin(angle_rad)); }

static void place_nodes(struct wave_nodes *w, const struct wave_outline *o)
{
    for (size_t i = 0; i < w->n; i++) {
        struct wave_node *p = &w->node[i];
        double complex d, dd;
        p->at = wave_outline_at(o, w->step * (double)i, &d, &dd);
        p->speed = cabs(d);
        p->normal = -I * d / p->speed;
        p->curvature = cimag(conj(d) * dd) / (p->speed * p->speed * p->speed);
    }
}

/* Integrals of ln(4 sin^2(t / 2)) times the trigonometric polynomials through the nodes, less their quadrature with
 * equal weights: a kernel K with the logarithmic part L ln(4 sin^2) has the weight K step + L log_weight. At distance
 * 0: the integral alone. */
static void weigh_logarithm(struct wave_nodes *w)
{
    const size_t half = w->n / 2;
    for (size_t j = 0; j <= half; j++) {
        const double t = w->step * (double)j, sine = sin(0.5 * t);
        double sum = (j % 2 == 0 ? 1 : -1) / (2.0 * (double)half);
        for (size_t m = 1; m < half; m++) sum += cos((double)(m * j % w->n) * w->step) / (double)m;
        w->log_weight[j] = -2 * w->step * sum;
        if (j > 0) w->log_weight[j] -= w->step * log(4 * sine * sine);
    }
}

status wave_nodes_init(struct wave_nodes *w, const struct wave_outline *o, size_t n, struct error *err)
{
    *w = (struct wave_nodes){.n = n, .step = 2 * M_PI / (double)n};
    w->node = malloc(n * sizeof *w->node);
    w->log_weight = malloc((n / 2 + 1) * sizeof *w->log_weight);
    if (w->node == NULL || w->log_weight == NULL) {
        wave_nodes_release(w);
        return error_set(err, STATUS_NO_MEMORY, "cannot set up a wave solver: out of memory");
    }
    place_nodes(w, o);
    weigh_logarithm(w);
    return STATUS_OK;
}

void wave_nodes_release(struct wave_nodes *w)
{
    free(w->node);
    free(w->log_weight);
    *w = (struct wave_nodes){0};
}

struct wave_kernels wave_kernels_between(const struct wave_nodes *w, double complex k, size_t i, size_t j)
{
    const struct wave_node *to = &w->node[i], *from = &w->node[j];
    const size_t apart = i > j ? i - j : j - i, steps = apart < w->n - apart ? apart : w->n - apart;
    const double complex away = to->at - from->at;
    const double r = cabs(away), a = wave_dot(to->normal, away) / r, b = wave_dot(from->normal, away) / r;
    const double log_part = -w->log_weight[steps] / (4 * M_PI);
    struct cylinder_functions f;
    cylinder_functions_at(k * r, &f);
    const double complex z0 = 0.25 * I * w->step * f.h[0] + log_part * f.j[0],
                         z1 = k * (0.25 * I * w->step * f.h[1] + log_part * f.j[1]);
    return (struct wave_kernels){z0, b * z1, -a * z1,
                                 wave_dot(to->normal, from->normal) * z1 / r + a * b * (k * k * z0 - 2 * z1 / r)};
}

struct wave_kernels wave_kernels_at(const struct wave_nodes *w, double complex k, size_t i)
{
    const struct wave_node *p = &w->node[i];
    const double complex log_half = clog(0.5 * k * p->speed) + EULER, square = k * k;
    const double log_weight = w->log_weight[0], bend = -w->step * p->curvature / (4 * M_PI);
    return (struct wave_kernels){-log_weight / (4 * M_PI) + w->step * (0.25 * I - log_half / (2 * M_PI)), bend, bend,
                                 -square / (8 * M_PI) * log_weight +
                                     w->step * square * (0.125 * I - log_half / (4 * M_PI) + 1 / (8 * M_PI))};
}

status wave_check_problem(const struct wave_outline *o, double k, double complex index, size_t n_node,
                          struct error *err)
{
    const double reach = wave_outline_length(o) / 2;
    if (!(k > 0) || !isfinite(k))
        return error_set_field(err, STATUS_INVALID, "k", "the wave number is %g, which is not positive", k);
    if (!(creal(index) > 0) || !(cimag(index) >= 0) || !isfinite(cabs(index)))
        return error_set_field(err, STATUS_INVALID, "index", "the index %g + %g i is not that of a medium that absorbs",
                               creal(index), cimag(index));
    if (!(cimag(index) * k * reach <= MOST_ABSORPTION))
        return error_set_field(err, STATUS_INVALID, "index",
                               "the fiber absorbs too much: exp(-%.3g) across it, at most exp(-%g)",
                               cimag(index) * k * reach, MOST_ABSORPTION);
    if (n_node < 8 || n_node % 2 != 0 || n_node > WAVE_MOST_NODE)
        return error_set_field(err, STATUS_INVALID, "n_node", "%zu nodes are not an even number from 8 to %d", n_node,
                               WAVE_MOST_NODE);
    return STATUS_OK;
}

/* Contribution of node i to T towards d: factors of u and of v / k. */
static void far_factors(const struct wave_nodes *w, double k, double complex d, size_t i, double complex factor[2])
{
    const struct wave_node *p = &w->node[i];
    factor[1] = 0.25 * I * k * w->step * p->speed * cexp(-I * k * wave_dot(d, p->at));
    factor[0] = I * wave_dot(d, p->normal) * factor[1];
}

void wave_nodes_towards(const struct wave_nodes *w, double k, double angle_rad, const struct wave_columns *c,
                        double complex *t)
{
    enum { CHUNK = 80 };
    const double complex d = wave_direction(angle_rad);
    for (size_t first = 0; first < c->n; first += CHUNK) {
        const size_t n = c->n - first < CHUNK ? c->n - first : CHUNK;
        double re[CHUNK] = {0}, im[CHUNK] = {0};
        for (size_t i = 0; i < w->n; i++) {
            double complex factor[2];
            far_factors(w, k, d, i, factor);
            for (int half = 0; half < 2; half++) {
                const double f = creal(factor[half]), g = cimag(factor[half]);
                const size_t row = ((size_t)half * w->n + i) * c->stride + first;
                for (size_t j = 0; j < n; j++) {
                    re[j] += f * c->re[row + j] - g * c->im[row + j];
                    im[j] += f * c->im[row + j] + g * c->re[row + j];
                }
            }
        }
        for (size_t j = 0; j < n; j++) t[first + j] = complex_of(re[j], im[j]);
    }
}

double wave_nodes_absorption(const struct wave_nodes *w, const struct wave_columns *c, size_t column)
{
    double sum = 0;
    for (size_t i = 0; i < w->n; i++) {
        const size_t u = i * c->stride + column, v = (w->n + i) * c->stride + column;
        sum += w->node[i].speed * (c->re[u] * c->im[v] - c->im[u] * c->re[v]); /* Im(conj(u) v) */
    }
    return -w->step * sum;
}
