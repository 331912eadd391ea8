#include "tests/support/wave/mie_oblique.h"

#include <math.h>
#include <stdlib.h>

int mie_oblique_init(struct mie_oblique *c, double x, double complex m, double theta_rad)
{
    const double sine = sin(theta_rad), xi = x * cos(theta_rad); /* cos(zeta), xi */
    const double complex eta = x * csqrt(m * m - sine * sine), square = m * m;
    const size_t n = (size_t)(xi + 6 * cbrt(xi)) + 16;
    c->kappa_x = xi;
    c->n_order = 0;
    if (n >= MIE_MAX_ORDER) return -1;
    double *j = calloc(n + 2, sizeof *j);
    double complex *d = calloc(n + 2, sizeof *d);
    if (j != NULL && d != NULL) {
        mie_bessel_j(xi, n + 1, j);
        mie_log_derivative(eta, n, d);
        double y = y0(xi), y_before = -y1(xi);
        for (size_t k = 0; k <= n; k++) {
            const double order = (double)k, j_before = k > 0 ? j[k - 1] : -j[1];
            const double complex h = j[k] + I * y, h_slope = j_before + I * y_before - order / xi * h;
            const double j_slope = j_before - order / xi * j[k];
            /* all over J_n(eta) */
            const double complex twist = order * sine * eta * (xi * xi / (eta * eta) - 1);
            const double complex D = twist * h, C = twist * j[k];
            const double complex A = I * xi * (xi * d[k] * j[k] - eta * j_slope);
            const double complex B = xi * (square * xi * d[k] * j[k] - eta * j_slope);
            const double complex V = xi * (square * xi * d[k] * h - eta * h_slope);
            const double complex W = I * xi * (eta * h_slope - xi * d[k] * h);
            const double complex below = W * V + I * D * D;
            c->along[k] = (W * B + I * D * C) / below;
            c->across[k] = -(A * V - I * C * D) / below;
            c->between[k] = (C * V - B * D) / below;
            c->n_order++;
            const double y_after = 2 * order / xi * y - y_before;
            y_before = y;
            y = y_after;
        }
    }
    free(j);
    free(d);
    return c->n_order > 0 ? 0 : -1;
}

double complex mie_oblique_amplitude(const struct mie_oblique *c, enum mie_field o, enum mie_field i, double d)
{
    const double complex *t = o != i ? c->between : i == MIE_ALONG ? c->along : c->across;
    const double complex sign = o == MIE_ALONG ? I : -I; /* the book turns the magnetic field by -i */
    double complex sum = o == i ? t[0] : 0;
    for (size_t k = 1; k < c->n_order; k++) sum += 2 * t[k] * (o == i ? cos((double)k * d) : sign * sin((double)k * d));
    return sum;
}

double mie_oblique_extinction(const struct mie_oblique *c, enum mie_field i)
{
    return 2 / c->kappa_x * creal(mie_oblique_amplitude(c, i, i, 0));
}

double mie_oblique_scattering(const struct mie_oblique *c, enum mie_field i)
{
    const double complex *t = i == MIE_ALONG ? c->along : c->across;
    double sum = pow(cabs(t[0]), 2);
    for (size_t k = 1; k < c->n_order; k++) sum += 2 * (pow(cabs(t[k]), 2) + pow(cabs(c->between[k]), 2));
    return 2 / c->kappa_x * sum;
}

double mie_oblique_published_error(void)
{
    static const struct {
        double x, n, k, theta_deg, of_along[2], of_across[2]; /* extinction and scattering */
    } published[] = {{5, 1.5, 0, 40, {2.066317120006, 2.066317120006}, {2.146458786297, 2.146458786297}},
                     {10, 1.55, 0.1, 70, {2.473633523774, 1.477250474116}, {2.429016160091, 1.470002729478}},
                     {40, 1.55, 0, 60, {1.760100586100, 1.760100586100}, {2.029462038479, 2.029462038479}},
                     {25, 1.6, 0.002, 85, {2.426250351732, 2.346418970968}, {2.566293415336, 2.501869326152}}};
    static struct mie_oblique c;
    double largest = 0;
    for (size_t k = 0; k < sizeof published / sizeof *published; k++) {
        if (mie_oblique_init(&c, published[k].x, published[k].n + I * published[k].k,
                             published[k].theta_deg * M_PI / 180) != 0)
            return INFINITY;
        for (int f = 0; f < 2; f++) {
            const double *want = f == MIE_ALONG ? published[k].of_along : published[k].of_across;
            largest = fmax(largest, fabs(mie_oblique_extinction(&c, (enum mie_field)f) - want[0]));
            largest = fmax(largest, fabs(mie_oblique_scattering(&c, (enum mie_field)f) - want[1]));
        }
    }
    return largest;
}
