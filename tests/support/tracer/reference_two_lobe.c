#include "tests/support/tracer/reference_two_lobe.h"

#include <math.h>

static double gauss(double x, double m, double s)
{
    return exp(-(x - m) * (x - m) / (2 * s * s)) / (sqrt(2 * M_PI) * s);
}

static double q(double t)
{
    double t2 = t * t;
    return 0.002439 * t2 * t2 * t2 * t2 - 0.04301 * t2 * t2 * t2 + 0.3322 * t2 * t2 - 0.999745 * t2 + 1.0001;
}

double reference_normaliser(double m, double s)
{
    enum { N = 400 };
    double lo = fmax(-M_PI_2, m - 9 * s), hi = fmin(M_PI_2, m + 9 * s), h = (hi - lo) / N, sum = 0;
    for (int i = 0; i <= N; i++) {
        double t = lo + i * h;
        sum += (i == 0 || i == N ? 1 : i % 2 == 1 ? 4 : 2) * gauss(t, m, s) * q(t);
    }
    return sum * h / 3;
}

double reference_gbar(double theta_o, double m, double s) { return gauss(theta_o, m, s) / reference_normaliser(m, s); }

/* The normaliser 2 pi I0 by the trapezoid rule, which is exact for periodic functions. */
double reference_von_mises(double phi, double s)
{
    int n = 32 + (int)(40 / s);
    double kappa = 1 / (s * s), sum = 0;
    for (int i = 0; i < n; i++) sum += exp(kappa * (cos(2 * M_PI * i / n) - 1));
    return exp(kappa * (cos(phi) - 1)) / (sum * 2 * M_PI / n);
}

double reference_s(const double param[9], const double wi[3], const double wo[3], int c)
{
    double theta_i = atan2(wi[0], hypot(wi[1], wi[2])), theta_o = atan2(wo[0], hypot(wo[1], wo[2]));
    double phi = atan2(wo[2], wo[1]) - atan2(wi[2], wi[1]);
    double fresnel = param[c] + (1 - param[c]) * pow(1 - cos(theta_i), 5);
    return fresnel * reference_gbar(theta_o, -theta_i, param[6]) / (2 * M_PI) +
           param[3 + c] * (1 - fresnel) * reference_gbar(theta_o, -theta_i, param[7]) *
               reference_von_mises(phi - M_PI, param[8]);
}

double reference_camera_furnace(const double param[9], double theta_o, int c)
{
    double total = 0;
    for (int lobe = 0; lobe < 2; lobe++) {
        enum { N = 1000 };
        double s = param[6 + lobe], lo = fmax(-M_PI_2, -theta_o - 9 * s), hi = fmin(M_PI_2, -theta_o + 9 * s),
               h = (hi - lo) / N;
        for (int i = 0; i < N; i++) {
            double t = lo + (i + 0.5) * h, fresnel = param[c] + (1 - param[c]) * pow(1 - cos(t), 5);
            double weight = lobe == 0 ? fresnel : param[3 + c] * (1 - fresnel);
            total += weight * reference_gbar(theta_o, -t, s) * cos(t) * cos(t) * h;
        }
    }
    return total;
}
