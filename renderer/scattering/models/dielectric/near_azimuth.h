/* Azimuthal lobes about the azimuth at which a ray leaves: a wrapped Gaussian (d'Eon et al. 2011, section 3.2) and the
 * trimmed logistic density of Chiang et al. 2016, section 4.1. Both have the integral 1 over a turn.
 *
 *     Gaussian   sum over k of exp(-(x + 2 pi k)^2 / (2 w^2)) / (sqrt(2 pi) w)
 *     logistic   e / (s (1 + e)^2 tanh(pi / (2 s))), e = exp(-|x| / s), x in [-pi, pi]
 */
#ifndef SELVEDGE_RENDERER_NEAR_AZIMUTH_H
#define SELVEDGE_RENDERER_NEAR_AZIMUTH_H

#include "renderer/scattering/von_mises.h"

#include <math.h>
#include <stddef.h>

enum near_azimuth_kind { NEAR_GAUSSIAN, NEAR_LOGISTIC };

struct near_azimuth {
    enum near_azimuth_kind kind;
    int n_image;        /* Gaussian: turns on either side that count */
    double width_rad;   /* w or s */
    double norm;        /* factor of the exponential */
    double d_ln_norm;   /* by the width */
    double below, span; /* logistic: its integral below -pi before trimming, and its integral over the turn */
};

static inline void near_azimuth_init(struct near_azimuth *a, enum near_azimuth_kind kind, double width_rad)
{
    const double w = width_rad;
    *a = (struct near_azimuth){.kind = kind, .width_rad = w};
    if (kind == NEAR_GAUSSIAN) {
        a->n_image = (int)((6.5 * w + M_PI) / (2 * M_PI));
        a->norm = 1 / (sqrt(2 * M_PI) * w);
        a->d_ln_norm = -1 / w;
        return;
    }
    a->span = tanh(M_PI / (2 * w));
    a->below = 1 / (1 + exp(M_PI / w));
    a->norm = 1 / (w * a->span);
    a->d_ln_norm = -1 / w + M_PI / (w * w * sinh(M_PI / w));
}

/* The density at x in [-pi, pi], and its derivatives by x and by the width when `d` is not NULL. */
static inline double near_azimuth_eval(const struct near_azimuth *a, double x, double d[2])
{
    const double w = a->width_rad;
    if (a->kind == NEAR_LOGISTIC) {
        double e = exp(-fabs(x) / w), value = a->norm * e / ((1 + e) * (1 + e));
        double slope = copysign((1 - e) / (1 + e), x) / w; /* -d ln by x */
        if (d != NULL) {
            d[0] = -value * slope;
            d[1] = value * (slope * x / w + a->d_ln_norm);
        }
        return value;
    }
    double sum = 0, first = 0, second = 0; /* moments of the exponentials */
    for (int k = -a->n_image; k <= a->n_image; k++) {
        double z = (x + 2 * M_PI * k) / w, e = exp(-0.5 * z * z);
        sum += e;
        first += z * e;
        second += z * z * e;
    }
    if (d != NULL) {
        d[0] = -a->norm * first / w;
        d[1] = a->norm * (second / w + sum * a->d_ln_norm);
    }
    return a->norm * sum;
}

/* Draws x from the density, with u in [0, 1); the Gaussian's x is not wrapped. */
static inline double near_azimuth_sample(const struct near_azimuth *a, float u)
{
    if (a->kind == NEAR_GAUSSIAN) return a->width_rad * M_SQRT2 * (double)erf_inverse(2 * u - 1);
    double t = a->below + (double)u * a->span;
    return fmax(-M_PI, fmin(M_PI, -a->width_rad * log(1 / t - 1)));
}

#endif
