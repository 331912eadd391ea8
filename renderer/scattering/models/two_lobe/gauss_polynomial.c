#include "renderer/scattering/models/two_lobe/gauss_polynomial.h"

#include <math.h>

enum { Q_DEGREE = 8 };
static const double q_coefficient[Q_DEGREE + 1] = {1.0001, 0, -0.999745, 0, 0.3322, 0, -0.04301, 0, 0.002439};

static double horner(const double *p, size_t k, double x)
{
    double v = p[k];
    for (size_t j = k; j-- > 0;) v = v * x + p[j];
    return v;
}

double gauss_polynomial_integral(const double *p, size_t k, double m, double s, double a, double b)
{
    double coefficient[GAUSS_POLYNOMIAL_MAX_DEGREE];
    coefficient[k - 1] = p[k];
    coefficient[k - 2] = p[k - 1] + m * coefficient[k - 1];
    for (size_t j = k - 2; j-- > 0;)
        coefficient[j] = p[j + 1] + m * coefficient[j + 1] + (double)(j + 2) * s * s * coefficient[j + 2];
    double half_a = 0.5 * (p[0] + m * coefficient[0] + s * s * coefficient[1]);
    double za = (a - m) / s, zb = (b - m) / s;
    double ga = exp(-0.5 * za * za) / (sqrt(2 * M_PI) * s), gb = exp(-0.5 * zb * zb) / (sqrt(2 * M_PI) * s);
    return half_a * (erf(zb * M_SQRT1_2) - erf(za * M_SQRT1_2)) -
           s * s * (horner(coefficient, k - 1, b) * gb - horner(coefficient, k - 1, a) * ga);
}

double lobe_q(double theta_rad) { return horner(q_coefficient, Q_DEGREE, theta_rad); }

double lobe_normaliser(double m_rad, double s_rad, double *d_m, double *d_s)
{
    const double lo = -M_PI_2, hi = M_PI_2;
    double p[Q_DEGREE + 3] = {0};
    if (d_m != NULL) { /* d g / d m = g (t - m) / s^2 */
        for (size_t j = 0; j <= Q_DEGREE + 1; j++)
            p[j] =
                ((j > 0 ? q_coefficient[j - 1] : 0) - (j <= Q_DEGREE ? m_rad * q_coefficient[j] : 0)) / (s_rad * s_rad);
        *d_m = gauss_polynomial_integral(p, Q_DEGREE + 1, m_rad, s_rad, lo, hi);
    }
    if (d_s != NULL) { /* d g / d s = g ((t - m)^2 - s^2) / s^3 */
        double c0 = m_rad * m_rad - s_rad * s_rad, c1 = -2 * m_rad, cube = s_rad * s_rad * s_rad;
        for (size_t j = 0; j <= Q_DEGREE + 2; j++) {
            double v = j <= Q_DEGREE ? c0 * q_coefficient[j] : 0;
            if (j >= 1 && j - 1 <= Q_DEGREE) v += c1 * q_coefficient[j - 1];
            if (j >= 2) v += q_coefficient[j - 2];
            p[j] = v / cube;
        }
        *d_s = gauss_polynomial_integral(p, Q_DEGREE + 2, m_rad, s_rad, lo, hi);
    }
    return gauss_polynomial_integral(q_coefficient, Q_DEGREE, m_rad, s_rad, lo, hi);
}
