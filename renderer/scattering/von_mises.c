#include "renderer/scattering/von_mises.h"

#include <math.h>

/* exp(-x) I_n(x) = 1/pi int_0^pi exp(x (cos t - 1)) cos(n t) dt, by the power series below 30 and Hankel's series
 * above. */
static double bessel_scaled(int n, double x)
{
    if (x < 30) {
        double term = n == 0 ? 1.0 : 0.5 * x, sum = term;
        for (int k = 1; k < 200 && term > sum * 1e-18; k++) {
            term *= 0.25 * x * x / ((double)k * (double)(k + n));
            sum += term;
        }
        return exp(-x) * sum;
    }
    double mu = 4.0 * n * n, term = 1, sum = 1;
    for (int k = 1; k < 30; k++) {
        double odd = 2 * k - 1, next = term * -(mu - odd * odd) / (8.0 * k * x);
        if (fabs(next) >= fabs(term)) break; /* asymptotic series: stop at its smallest term */
        term = next;
        sum += term;
        if (fabs(term) < 1e-17) break;
    }
    return sum / sqrt(2 * M_PI * x);
}

double bessel_i0_scaled(double x) { return bessel_scaled(0, x); }

double bessel_i1_over_i0_deficit(double x) { return 1 - bessel_scaled(1, x) / bessel_scaled(0, x); }

/* dK/dz = normal density / von Mises density. */
static double quantile_slope(double kappa, double norm, double z, double k)
{
    double half = sin(0.5 * k);
    return exp(-0.5 * z * z + 2 * kappa * half * half) / (sqrt(2 * M_PI) * norm);
}

void von_mises_init(struct von_mises *v, double s_rad)
{
    double kappa = 1 / (s_rad * s_rad), norm = 1 / (2 * M_PI * bessel_i0_scaled(kappa));
    double d_kappa = -2 / (s_rad * s_rad * s_rad);
    v->kappa = (float)kappa;
    v->norm = (float)norm;
    v->score_at_peak = (float)(d_kappa * bessel_i1_over_i0_deficit(kappa));
    v->score_slope = (float)d_kappa;

    const double step = (double)VON_MISES_Z_MAX / VON_MISES_N_PIECE;
    double k = 0;
    for (int i = 0; i <= VON_MISES_N_PIECE; i++) {
        double z = i * step;
        v->node[i][0] = (float)k;
        v->node[i][1] = (float)(step * quantile_slope(kappa, norm, z, k));
        for (int half = 0; half < 2; half++) { /* two Runge-Kutta steps a piece */
            double h = 0.5 * step, z0 = z + half * h;
            double a = quantile_slope(kappa, norm, z0, k);
            double b = quantile_slope(kappa, norm, z0 + 0.5 * h, k + 0.5 * h * a);
            double c = quantile_slope(kappa, norm, z0 + 0.5 * h, k + 0.5 * h * b);
            double d = quantile_slope(kappa, norm, z0 + h, k + h * c);
            k += h / 6 * (a + 2 * b + 2 * c + d);
        }
        if (k > M_PI) k = M_PI;
    }
}

float von_mises_sample(const struct von_mises *v, float u)
{
    float z = (float)M_SQRT2 * erf_inverse(2 * u - 1), x = fabsf(z) * (VON_MISES_N_PIECE / VON_MISES_Z_MAX);
    int i = x < VON_MISES_N_PIECE - 1 ? (int)x : VON_MISES_N_PIECE - 1;
    float t = x - (float)i;
    const float *a = v->node[i], *b = v->node[i + 1];
    float d = b[0] - a[0];
    float k = a[0] + t * (a[1] + t * (3 * d - 2 * a[1] - b[1] + t * (a[1] + b[1] - 2 * d)));
    if (k > (float)M_PI) k = (float)M_PI;
    return copysignf(k, z);
}

float erf_inverse(float x)
{
    float q = (1 - x) * (1 + x);
    float w = -logf(q > 1.2e-7f ? q : 1.2e-7f), p;
    if (w < 5) {
        w -= 2.5f;
        p = 2.81022636e-08f;
        p = 3.43273939e-07f + p * w;
        p = -3.5233877e-06f + p * w;
        p = -4.39150654e-06f + p * w;
        p = 0.00021858087f + p * w;
        p = -0.00125372503f + p * w;
        p = -0.00417768164f + p * w;
        p = 0.246640727f + p * w;
        p = 1.50140941f + p * w;
    } else {
        w = sqrtf(w) - 3;
        p = -0.000200214257f;
        p = 0.000100950558f + p * w;
        p = 0.00134934322f + p * w;
        p = -0.00367342844f + p * w;
        p = 0.00573950773f + p * w;
        p = -0.0076224613f + p * w;
        p = 0.00943887047f + p * w;
        p = 1.00167406f + p * w;
        p = 2.83297682f + p * w;
    }
    return p * x;
}
