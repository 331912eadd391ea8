#include "optimizer/report/export/hair_lobes.h"
#include "renderer/scattering/fresnel.h"

#include <math.h>
#include <string.h>

enum {
    N_LOBE = 3,
    N_OFFSET = 16
}; /* R, TT, TRT, each with a trimmed logistic about its azimuth; the rest is uniform */

static double power_of(double x, int n)
{
    double y = 1.0;
    while (n-- > 0) y *= x;
    return y;
}

/* Longitudinal variances of the lobes, Chiang et al. 2016, equation 7 and below; the rest has the variance of TRT. */
static void variances(double beta_m, double v[N_LOBE + 1])
{
    double s = 0.726 * beta_m + 0.812 * beta_m * beta_m + 3.7 * power_of(beta_m, 20);
    v[0] = s * s;
    v[1] = 0.25 * v[0];
    v[2] = v[3] = 4.0 * v[0];
}

static double scale_of(double beta_n)
{
    return sqrt(M_PI / 8.0) * (0.265 * beta_n + 1.194 * beta_n * beta_n + 5.372 * power_of(beta_n, 22));
}

static double bessel_i0(double x)
{
    double sum = 1.0, term = 1.0;
    for (int k = 1; k < 24; k++) {
        term *= 0.25 * x * x / ((double)k * k);
        sum += term;
    }
    return sum;
}

static double log_bessel_i0(double x)
{
    return x > 12.0 ? x + 0.5 * (-log(2.0 * M_PI) + log(1.0 / x) + 1.0 / (8.0 * x)) : log(bessel_i0(x));
}

/* Longitudinal scattering, d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model", equation 7. */
static double longitudinal(double theta_i, double theta_o, double v)
{
    double a = cos(theta_i) * cos(theta_o) / v, b = sin(theta_i) * sin(theta_o) / v;
    if (v <= 0.1) return exp(log_bessel_i0(a) - b - 1.0 / v + log(2.0) + log(1.0 / (2.0 * v)));
    return exp(-b) * bessel_i0(a) / (sinh(1.0 / v) * 2.0 * v);
}

static double logistic_cdf(double x, double s) { return 1.0 / (1.0 + exp(-x / s)); }

/* Logistic density trimmed to a turn. */
static double trimmed_logistic(double x, double s)
{
    x = remainder(x, 2.0 * M_PI);
    double e = exp(-fabs(x) / s);
    return e / (s * (1.0 + e) * (1.0 + e)) / (logistic_cdf(M_PI, s) - logistic_cdf(-M_PI, s));
}

/* Shares of the light in the lobes and in the rest, for an offset h; and gamma_o, gamma_t. */
static void attenuations(const struct hair_lobes *l, double h, double theta_o, double share[N_LOBE + 1][3],
                         double gamma[2])
{
    double cos_o = cos(theta_o), sin_t = sin(theta_o) / l->index, cos_t = sqrt(1.0 - sin_t * sin_t);
    double eta = sqrt(l->index * l->index - sin(theta_o) * sin(theta_o)) / cos_o, sin_gamma = h / eta;
    double f = fresnel_unpolarised(cos_o * sqrt(1.0 - h * h), l->index, NULL);
    gamma[0] = asin(h);
    gamma[1] = asin(sin_gamma);
    for (int c = 0; c < 3; c++) {
        double t = exp(-l->absorption[c] * 2.0 * cos(gamma[1]) / cos_t);
        share[0][c] = f;
        share[1][c] = (1.0 - f) * (1.0 - f) * t;
        share[2][c] = share[1][c] * t * f;
        share[3][c] = share[2][c] * f * t / (1.0 - t * f);
    }
}

/* Azimuthal part of each lobe with its share of the light, a mean over the offsets h = sin(angle): out[lobe][3]. */
static void azimuthal(const struct hair_lobes *l, double theta_o, double phi, double out[N_LOBE + 1][3])
{
    const double s = scale_of(l->azimuthal_roughness);
    memset(out, 0, (N_LOBE + 1) * sizeof *out);
    for (int k = 0; k < 2 * N_OFFSET; k++) {
        double angle = M_PI_2 * (-1.0 + (k + 0.5) / N_OFFSET), weight = cos(angle) * M_PI_4 / N_OFFSET;
        double share[N_LOBE + 1][3], gamma[2];
        attenuations(l, sin(angle), theta_o, share, gamma);
        for (int p = 0; p <= N_LOBE; p++) {
            double towards = 2.0 * p * gamma[1] - 2.0 * gamma[0] + p * M_PI;
            double n = p < N_LOBE ? trimmed_logistic(phi - towards, s) : 0.5 / M_PI;
            for (int c = 0; c < 3; c++) out[p][c] += weight * n * share[p][c];
        }
    }
}

void hair_lobes_density(const struct hair_lobes *l, double part_of_light, double theta_o_rad,
                        const struct hair_directions *to, double *out)
{
    const size_t n_phi = to->n_phi < HAIR_LOBES_MAX_PHI ? to->n_phi : HAIR_LOBES_MAX_PHI;
    double v[N_LOBE + 1], part[HAIR_LOBES_MAX_PHI][N_LOBE + 1][3];
    variances(l->longitudinal_roughness, v);
    for (size_t j = 0; j < n_phi; j++) azimuthal(l, theta_o_rad, to->phi_rad[j], part[j]);
    for (size_t i = 0; i < to->n_theta; i++)
        for (int p = 0; p <= N_LOBE; p++) {
            const double m = part_of_light * longitudinal(to->theta_i_rad[i], theta_o_rad, v[p]);
            for (size_t j = 0; j < n_phi; j++)
                for (size_t c = 0; c < 3; c++) out[3 * (i * to->n_phi + j) + c] += m * part[j][p][c];
        }
}
