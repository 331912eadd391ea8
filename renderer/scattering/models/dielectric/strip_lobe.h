/* Light that a fiber diffracts past itself: far from the fiber, its shadow equals the shadow of an opaque strip as wide
 * as the fiber, and diffracts like a slit of this width (Babinet's principle; Born and Wolf 1999, "Principles of
 * Optics", sections 8.5.1 and 8.3.2).
 *
 *     F(d; A) = A h(pi A sin d) / c(A)   for |d| < pi / 2, and 0 behind,   d from straight on,   A = D cos th / lambda
 *     h(y) = (1 - cos(2 y) exp(-2 s^2 y^2)) / (2 y^2)
 *
 * D is the diameter. A channel of a camera sees a band of wavelengths: h is the mean of sin^2(y) / y^2 over wave
 * numbers that are normally distributed about 1 / lambda with the relative deviation s, weighted by the wave number.
 * It blurs the outer fringes; s = 0 is one wavelength, h = sinc^2. c(A) makes the integral of F over all azimuths 1.
 * For s = 0 it is 0.972 at A = 1 and 0.9996 at A = 20, and near A = 0 pi A (1 + s^2), where F is uniform over the
 * half in front.
 */
#ifndef SELVEDGE_RENDERER_STRIP_LOBE_H
#define SELVEDGE_RENDERER_STRIP_LOBE_H

#include <math.h>
#include <stddef.h>

enum { STRIP_LOBE_N = 512 }; /* intervals of the table of c, equidistant in A / (1 + A) */

struct strip_lobe {
    double band;                   /* s */
    double integral[STRIP_LOBE_N]; /* c (1 + A) / A; node i is A = i / (N - i) */
};

/* h, and y h' when wanted. */
static inline double strip_lobe_fringe(double band, double y, double *slope)
{
    const double v = band * band, y2 = y * y;
    if (y2 < 1e-6) {
        if (slope != NULL) *slope = -2 * y2 * (1.0 / 3 + 2 * v + v * v);
        return 1 + v - y2 * (1.0 / 3 + 2 * v + v * v);
    }
    const double fade = exp(-2 * v * y2), c = cos(2 * y) * fade, h = (1 - c) / (2 * y2);
    if (slope != NULL) *slope = sin(2 * y) * fade / y + 2 * v * c - 2 * h;
    return h;
}

static inline void strip_lobe_init(struct strip_lobe *l, double band)
{
    l->band = band;
    l->integral[0] = M_PI * (1 + band * band);
    for (int i = 1; i < STRIP_LOBE_N; i++) {
        const double t = (double)i / STRIP_LOBE_N, a = t / (1 - t);
        const int n =
            16 + (int)(2 * a); /* of a quarter turn, by Gauss and Chebyshev's rule: sin d = cos of the nodes */
        double sum = 0;
        for (int k = 0; k < n; k++) sum += strip_lobe_fringe(band, M_PI * a * sin((k + 0.5) * M_PI_2 / n), NULL);
        l->integral[i] = a * sum * M_PI / n / t;
    }
}

/* F for the sine of d, in front; and d ln F by ln A when wanted. A is at most 511. */
static inline double strip_lobe_eval(const struct strip_lobe *l, double a, double sine, double *slope)
{
    const double t = a / (1 + a), x = t * STRIP_LOBE_N;
    const int i = x < STRIP_LOBE_N - 2 ? (int)x : STRIP_LOBE_N - 2;
    const double d_c = (l->integral[i + 1] - l->integral[i]) * STRIP_LOBE_N,
                 c = l->integral[i] + (x - i) * d_c / STRIP_LOBE_N;
    double y_slope, h = strip_lobe_fringe(l->band, M_PI * a * sine, slope != NULL ? &y_slope : NULL);
    /* A / c = (1 + A) / (c (1 + A) / A), and d t / d ln A = t (1 - t) */
    if (slope != NULL) *slope = y_slope / h + t - t * (1 - t) * d_c / c;
    return (1 + a) * h / c;
}

/* Density of samples of d, a Lorentz curve in w = 2 A tan(d / 2) that covers the fringes: at least 0.3 F everywhere.
 * tangent: tan(d / 2), between -1 and 1; 0 beyond. */
static inline double strip_lobe_density(double a, double tangent)
{
    const double w = 2 * M_PI * a * tangent;
    return fabs(tangent) > 1 ? 0 : 0.5 * M_PI * a * (1 + tangent * tangent) / ((1 + w * w) * atan(2 * M_PI * a));
}

/* tan(d / 2) for u in [0, 1); a > 0. */
static inline double strip_lobe_sample(double a, double u)
{
    return fmax(-1, fmin(1, tan((2 * u - 1) * atan(2 * M_PI * a)) / (2 * M_PI * a)));
}

#endif
