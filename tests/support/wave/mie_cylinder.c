#include "tests/support/wave/mie_cylinder.h"

#include <math.h>
#include <stdlib.h>

const struct mie_published mie_published[MIE_N_PUBLISHED] = {
    {0.5, 1.5, 0, MIE_ALONG, 0.275472443940, 0.275472443940},
    {0.5, 1.5, 0, MIE_ACROSS, 0.044463476396, 0.044463476396},
    {5.213, 1.55, 0, MIE_ALONG, 2.097285180317, 2.097285180317},
    {5.213, 1.55, 0, MIE_ACROSS, 1.927499817610, 1.927499817610},
    {10, 1.55, 0.1, MIE_ALONG, 2.300005312414, 1.295846503548},
    {10, 1.55, 0.1, MIE_ACROSS, 2.271304915592, 1.167620761119},
    {40, 1.549, 0, MIE_ALONG, 1.765404190481, 1.765404190481},
    {40, 1.549, 0, MIE_ACROSS, 1.773056222555, 1.773056222555},
    {60, 1.33, 0.001, MIE_ALONG, 1.914329301572, 1.705889583990},
    {60, 1.33, 0.001, MIE_ACROSS, 1.878337577025, 1.676660902154},
    {150, 1.55, 0.001, MIE_ALONG, 1.921009659434, 1.511393267266},
    {150, 1.55, 0.001, MIE_ACROSS, 1.920728167052, 1.489741891752}};

enum { MORE_ORDERS = 60 };

void mie_bessel_j(double x, size_t n, double *j)
{
    size_t from = n + MORE_ORDERS + (size_t)(4 * cbrt(x));
    double above = 0, here = 1e-300, sum = 0;
    for (size_t k = from; k > 0; k--) {
        if (k <= n) j[k] = here;
        if (k % 2 == 0) sum += 2 * here;
        const double below = 2 * (double)k / x * here - above;
        above = here;
        here = below;
        if (fabs(here) < 1e250) continue;
        here *= 1e-250;
        above *= 1e-250;
        sum *= 1e-250;
        for (size_t i = k; i <= n; i++) j[i] *= 1e-250;
    }
    j[0] = here;
    sum += here;
    for (size_t k = 0; k <= n; k++) j[k] /= sum;
}

void mie_log_derivative(double complex z, size_t n, double complex *d)
{
    const size_t from = (size_t)fmax((double)n, cabs(z)) + MORE_ORDERS;
    double complex here = 0;
    for (size_t k = from; k > 0; k--) {
        const double order = (double)k;
        if (k <= n) d[k] = here;
        here = (order - 1) / z - 1 / (here + order / z);
    }
    d[0] = here;
}

int mie_cylinder_init(struct mie_cylinder *c, double x, double complex m, enum mie_field field)
{
    const size_t n = (size_t)(x + 6 * cbrt(x)) + 10;
    if (n >= MIE_MAX_ORDER) return -1;
    double *j = calloc(n + 2, sizeof *j);
    double complex *d = calloc(n + 2, sizeof *d);
    c->x = x;
    c->n_order = 0;
    if (j != NULL && d != NULL) {
        mie_bessel_j(x, n + 1, j);
        if (!isinf(creal(m))) mie_log_derivative(m * x, n, d);
        double y = y0(x), y_before = -y1(x); /* Y_-1 = -Y_1, and J_-1 = -J_1 */
        for (size_t k = 0; k <= n; k++) {
            const double order = (double)k, j_before = k > 0 ? j[k - 1] : -j[1];
            const double complex h = j[k] + I * y, h_slope = j_before + I * y_before - order / x * h;
            const double j_slope = j_before - order / x * j[k];
            const double complex by = field == MIE_ALONG ? m * d[k] : d[k] / m;
            double complex t = (j_slope - by * j[k]) / (h_slope - by * h);
            if (isinf(creal(m))) t = field == MIE_ALONG ? j[k] / h : j_slope / h_slope;
            c->t[c->n_order++] = t;
            const double y_after = 2 * order / x * y - y_before;
            y_before = y;
            y = y_after;
        }
    }
    free(j);
    free(d);
    return c->n_order > 0 ? 0 : -1;
}

double complex mie_amplitude(const struct mie_cylinder *c, double angle_rad)
{
    double complex sum = c->t[0];
    for (size_t k = 1; k < c->n_order; k++) sum += 2 * c->t[k] * cos((double)k * angle_rad);
    return sum;
}

double mie_extinction(const struct mie_cylinder *c) { return 2 / c->x * creal(mie_amplitude(c, 0)); }

double mie_scattering(const struct mie_cylinder *c)
{
    double sum = 0;
    for (size_t k = 0; k < c->n_order; k++) sum += (k > 0 ? 2 : 1) * pow(cabs(c->t[k]), 2);
    return 2 / c->x * sum;
}

double mie_published_error(void)
{
    struct mie_cylinder c;
    double largest = 0;
    for (int i = 0; i < MIE_N_PUBLISHED; i++) {
        const struct mie_published *p = &mie_published[i];
        if (mie_cylinder_init(&c, p->x, p->n + I * p->k, p->field) != 0) return INFINITY;
        largest = fmax(largest, fabs(mie_extinction(&c) - p->extinction));
        largest = fmax(largest, fabs(mie_scattering(&c) - p->scattering));
    }
    return largest;
}
