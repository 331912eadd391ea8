#include "renderer/scattering/models/wave/solver/cylinder_functions.h"

#include "renderer/scattering/models/wave/solver/complex_parts.h"

#include <math.h>

#define EULER 0.57721566490153286061
#define FAR 17.0

enum { N_TERM = 34 };

static void by_recurrence(double complex z, struct cylinder_functions *f)
{
    const int n = 2 * (int)(0.6 * cabs(z) + 15);
    const double complex inv = 1 / z, turn[4] = {1, -I, -1, I}; /* (-i)^k */
    double complex above = 0, here = 1e-250, sum = 0, y0_sum = 0, y1_sum = 0;
    for (int k = n; k > 0; k--) { /* here = J_k */
        const int half = k / 2;
        const double sign = half % 2 == 0 ? 1 : -1;
        sum += 2 * complex_product(turn[k % 4], here);
        if (k % 2 == 0)
            y0_sum += sign / half * here;
        else if (half > 0)
            y1_sum += sign * k / (half * (half + 1.0)) * here;
        const double complex below = 2 * k * complex_product(inv, here) - above;
        above = here;
        here = below;
    }
    const double complex scale = cexp(-I * z) / (sum + here), log_half = clog(0.5 * z) + EULER;
    f->j[0] = complex_product(here, scale);
    f->j[1] = complex_product(above, scale);
    const double complex y0 = complex_product(log_half, f->j[0]) - 2 * complex_product(y0_sum, scale);
    const double complex y1 =
        complex_product(log_half - 1, f->j[1]) - complex_product(y1_sum, scale) - complex_product(inv, f->j[0]);
    f->h[0] = f->j[0] + I * M_2_PI * y0;
    f->h[1] = f->j[1] + I * M_2_PI * y1;
}

/* P and i Q of one order. */
static void asymptotic_series(double complex inv, double square, double complex *p, double complex *iq)
{
    double complex term = 1, step = I * inv / 8;
    *p = 1;
    *iq = 0;
    for (int k = 1; k <= N_TERM; k++) {
        const double odd = 2 * k - 1;
        term = complex_product(term, step) * ((square - odd * odd) / k);
        if (k % 2 == 0)
            *p += term;
        else
            *iq += term;
        if (fabs(creal(term)) + fabs(cimag(term)) < 1e-17) break;
    }
}

static void far_away(double complex z, struct cylinder_functions *f)
{
    const double complex inv = 1 / z, root = csqrt(M_2_PI * inv);
    double complex wave = cexp(I * (z - M_PI_4)); /* exp(i chi) */
    for (int order = 0; order < 2; order++) {
        double complex p, iq;
        asymptotic_series(inv, 4.0 * order, &p, &iq);
        f->h[order] = complex_product(root, complex_product(wave, p + iq));
        f->j[order] = 0.5 * (f->h[order] + complex_product(root, (p - iq) / wave));
        wave = complex_product(wave, -I);
    }
}

void cylinder_functions_at(double complex z, struct cylinder_functions *f)
{
    if (cabs(z) < FAR)
        by_recurrence(z, f);
    else
        far_away(z, f);
}
