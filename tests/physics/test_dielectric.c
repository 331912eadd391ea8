/* dielectric.v1 against implementations of their own: rays through a cylinder traced with vectors in space, its
 * azimuthal function by a sum over offsets with explicit wrapped Gaussians, and the furnace from both sides.
 */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/scattering/cone_lobe.h"
#include "renderer/scattering/models/dielectric/dielectric_ray.h"
#include "renderer/scattering/scattering.h"
#include "tests/support/model/fiber_angles.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/model/prepared_model.h"

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Snell's law for a ray d (unit) that meets a wall with normal n on the side that it comes from, by amplitudes of both
 * polarisations. Returns the reflectance; `out` is the refracted ray. */
static double refract(const double d[3], const double n[3], double n1, double n2, double out[3])
{
    double c1 = -dot(d, n), k = n1 / n2, c2 = sqrt(1 - k * k * (1 - c1 * c1));
    for (int i = 0; i < 3; i++) out[i] = k * d[i] + (k * c1 - c2) * n[i];
    double rs = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2), rp = (n2 * c1 - n1 * c2) / (n2 * c1 + n1 * c2);
    return 0.5 * (rs * rs + rp * rp);
}

static void reflect(const double d[3], const double n[3], double out[3])
{
    double c = dot(d, n);
    for (int i = 0; i < 3; i++) out[i] = d[i] - 2 * c * n[i];
}

/* A ray that comes from (theta, azimuth 0) at offset h, followed through a cylinder of radius 1 along x: shares and
 * azimuths of R, TT and TRT, with the extinction that lets c_t of the light through a diameter. */
static void trace(double theta, double h, double eta, double c_t, double share[3], double azimuth[3])
{
    double d[3] = {-sin(theta), -cos(theta), 0}, at[3] = {0, sqrt(1 - h * h), h}, n[3] = {0, at[1], at[2]}, out[3];
    const double extinction = -log(c_t) / 2;
    double f = refract(d, n, 1, eta, out), left = 1 - f, mirrored[3];
    reflect(d, n, mirrored);
    share[0] = f;
    azimuth[0] = atan2(mirrored[2], mirrored[1]);
    for (int p = 1; p < 3; p++) {
        double inside[3], leaving[3];
        double along = -2 * (at[1] * out[1] + at[2] * out[2]) / (out[1] * out[1] + out[2] * out[2]);
        for (int i = 0; i < 3; i++) at[i] += along * out[i];
        left *= exp(-extinction * along);
        for (int i = 0; i < 3; i++) n[i] = i == 0 ? 0 : -at[i]; /* towards the axis */
        f = refract(out, n, eta, 1, leaving);
        share[p] = left * (1 - f);
        azimuth[p] = atan2(leaving[2], leaving[1]);
        assert_true(fabs(asin(leaving[0]) + theta) < 1e-9); /* every mode leaves on the same cone */
        left *= f;
        reflect(out, n, inside);
        for (int i = 0; i < 3; i++) out[i] = inside[i];
    }
}

static void rays_in_space(void **state)
{
    (void)state;
    struct rng r;
    rng_start(&r, &(struct rng_key){61, 0, 0, 0}, 0, 0);
    for (int i = 0; i < 2000; i++) {
        double theta = (rng_double(&r) - 0.5) * 175 * RAD_PER_DEG, x = (rng_double(&r) - 0.5) * M_PI * 0.999;
        double eta = 1.3 + 0.5 * rng_double(&r), c_t = 0.01 + 0.98 * rng_double(&r), share[3], azimuth[3], sum = 0;
        struct dielectric_ray ray = dielectric_ray_at(cos(theta), x, eta);
        struct dielectric_shares got = dielectric_shares_of(&ray, c_t, log(c_t));
        struct dielectric_shares clear = dielectric_shares_of(&ray, 1, 0);
        trace(theta, sin(x), eta, c_t, share, azimuth);
        for (int p = 0; p < 3; p++) {
            double d_eta, phi = dielectric_azimuth(&ray, p, x, &d_eta);
            assert_true(fabs(got.value[p] - share[p]) < 1e-9);
            /* a ray at offset h > 0 leaves by R at a positive azimuth */
            assert_true(fabs(remainder(-phi - azimuth[p], 2 * M_PI)) < 1e-6);
        }
        for (int p = 0; p < DIELECTRIC_N_MODE; p++) sum += clear.value[p];
        assert_true(fabs(sum - 1) < 1e-12);
    }
}

/* Mean shares of a clear fiber of index 1.55 at normal incidence: R, TT, TRT, TRRT, to three digits (design notes on
 * fiber models, section 2.1, for a round section). The rest contains TRRT and more. */
static void mean_shares(void **state)
{
    (void)state;
    enum { N = 4000 };
    static const double want[4] = {0.075, 0.862, 0.056, 0.006};
    double mean[4] = {0};
    for (int i = 0; i < N; i++) {
        double x = (i + 0.5) * M_PI_2 / N;
        struct dielectric_ray ray = dielectric_ray_at(1, x, 1.55);
        struct dielectric_shares a = dielectric_shares_of(&ray, 1, 0);
        for (int p = 0; p < 4; p++) mean[p] += (p < 3 ? a.value[p] : a.value[2] * ray.fresnel) * cos(x) * M_PI_2 / N;
    }
    for (int p = 0; p < 4; p++) assert_true(fabs(mean[p] - want[p]) < 6e-4);
}

static void published_lobe(void **state)
{
    (void)state;
    struct cone_lobe m;
    double i = 20 * RAD_PER_DEG, o = -12 * RAD_PER_DEG;
    cone_lobe_init(&m, 8 * RAD_PER_DEG);
    double got = (double)cone_lobe_eval(&m, (float)sin(i), (float)cos(i), (float)sin(o), (float)cos(o), NULL);
    assert_true(fabs(got / 1.813914147 - 1) < 3e-6); /* float */
}

/* The azimuthal function of one mode by explicit images of the Gaussian. */
static double reference_azimuth(const double *param, int p, int channel, double theta_d, double phi)
{
    enum { N = 2000 };
    double sum = 0, w = sqrt(p + 1.0) * param[5], weights = 0;
    for (int i = 0; i < N; i++) {
        double x = (i + 0.5) * M_PI / N - M_PI_2, d_eta, weight = cos(x);
        struct dielectric_ray ray = dielectric_ray_at(cos(theta_d), x, param[3]);
        struct dielectric_shares a = dielectric_shares_of(&ray, param[channel], log(param[channel]));
        double at = p < 3 ? dielectric_azimuth(&ray, p, x, &d_eta) : 0, n = 0;
        for (int image = -4; p < 3 && image <= 4; image++) {
            double z = (remainder(phi - at, 2 * M_PI) + 2 * M_PI * image) / w;
            n += exp(-0.5 * z * z) / (sqrt(2 * M_PI) * w);
        }
        sum += weight * a.value[p] * (p < 3 ? n : 0.5 / M_PI);
        weights += weight;
    }
    return sum / weights;
}

/* Ratios of S between azimuths at one pair of longitudinal angles do not contain a(th), and check N and the mixture of
 * the modes. The tables are read by straight lines: between azimuths a Gaussian of width w has an error of at most
 * step^2 / (8 w^2) of its peak, 0.8 % for R of 4 degrees at a step of 1 degree; R is a fraction of the largest S.
 * Between values of cos th_d the shares bend less. */
static void azimuths(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("dielectric.v1");
    static const double set[3][3] = {{1.55, 8, 15}, {1.35, 4, 4}, {1.75, 20, 40}}, theta_deg[3] = {0, 35, 70};
    for (int k = 0; k < 3; k++) {
        const double param[6] = {0.9, 0.5, 0.1, set[k][0], set[k][1] * RAD_PER_DEG, set[k][2] * RAD_PER_DEG};
        struct scattering_state *s = prepare(m, param);
        for (int t = 0; t < 3; t++)
            for (int c = 0; c < 3; c++) {
                double theta = theta_deg[t] * RAD_PER_DEG, got[19], want[19], top = 0, scale = 0, weight = 0;
                for (int j = 0; j < 19; j++) {
                    float wi[3], wo[3], rgb[3];
                    double phi = j * 10.3 * RAD_PER_DEG;
                    direction(theta, 0.3, wi);
                    direction(-theta, 0.3 + phi, wo);
                    m->eval(s, wi, wo, rgb, NULL);
                    got[j] = (double)rgb[c];
                    want[j] = 0;
                    for (int p = 0; p < 4; p++) {
                        struct cone_lobe lobe;
                        cone_lobe_init(&lobe, param[4] * (p == 0 ? 1 : p == 1 ? 0.5 : 2));
                        const float cosine = (float)cos(theta);
                        double along = (double)cone_lobe_eval(&lobe, wi[0], cosine, wo[0], cosine, NULL);
                        want[j] += along * reference_azimuth(param, p, c, theta, phi);
                    }
                    top = fmax(top, want[j]);
                    scale += got[j];
                    weight += want[j];
                }
                for (int j = 0; j < 19; j++)
                    if (!(fabs(got[j] * weight / scale - want[j]) < 0.005 * want[j] + 0.004 * top))
                        fail_msg("set %d, %g degrees, channel %d, azimuth %g: %g instead of %g (largest %g)", k,
                                 theta_deg[t], c, j * 10.3, got[j] * weight / scale, want[j], top);
            }
        m->release(s);
    }
}

/* Integral of S cos th over all directions of one side, extrapolated to C_T = 1 by the score: 1. The quadrature and the
 * tables of a(th) allow 1e-3; at 89 degrees cos th itself is 0.017 and a table cell is a fifth of it. */
static void lossless_from_both_sides(void **state)
{
    (void)state;
    enum { N_THETA = 1440, N_PHI = 180 };
    const struct scattering_model *m = scattering_find("dielectric.v1");
    static const double set[4][3] = {{1.55, 8, 15}, {1.35, 2, 4}, {1.75, 25, 40}, {1.5, 15, 60}};
    for (int k = 0; k < 4; k++) {
        const double param[6] = {0.999, 0.999, 0.999, set[k][0], set[k][1] * RAD_PER_DEG, set[k][2] * RAD_PER_DEG};
        struct scattering_state *s = prepare(m, param);
        for (int t = 0; t < 5; t++)
            for (int side = 0; side < 2; side++) {
                static const double theta_deg[5] = {0, -30, 60, 80, -89};
                double sum = 0, clear = 0;
                float at[3], other[3], rgb[3], score[18];
                direction(theta_deg[t] * RAD_PER_DEG, 0, at);
                for (int i = 0; i < N_THETA; i++)
                    for (int j = 0; j < N_PHI; j++) {
                        double theta = -M_PI_2 + (i + 0.5) * M_PI / N_THETA, c = cos(theta);
                        direction(theta, (j + 0.5) * 2 * M_PI / N_PHI, other);
                        m->eval(s, side == 0 ? at : other, side == 0 ? other : at, rgb, score);
                        double part = (double)rgb[0] * c * c * (M_PI / N_THETA) * (2 * M_PI / N_PHI);
                        sum += part;
                        clear += part * (1 + 0.001 * (double)score[0]);
                    }
                assert_true(sum < clear);
                if (!(fabs(clear - 1) < (fabs(theta_deg[t]) > 85 ? 5e-3 : 1e-3)))
                    fail_msg("set %d, side %d, %g degrees: %.5f, without absorption %.5f", k, side, theta_deg[t], sum,
                             clear);
            }
        m->release(s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_in_space),
        cmocka_unit_test(mean_shares),
        cmocka_unit_test(published_lobe),
        cmocka_unit_test(azimuths),
        cmocka_unit_test(lossless_from_both_sides),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
