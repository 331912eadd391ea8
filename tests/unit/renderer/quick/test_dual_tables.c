/* Averages for dual scattering: against other ways to compute them, and closed forms against their series. */
#include "base/rng.h"
#include "tests/support/cloth/dual_cloth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- averages ---- */

static void deep_fraction_is_the_sum_of_its_series(void **state)
{
    (void)state;
    for (int i = 0; i < 5; i++) {
        double f = 0.1 + 0.2 * i, b = 0.9 * (1 - f), sum = 0;
        for (int n = 1; n < 400; n++) sum += b * pow(f, 2 * n);
        /* down through n fibers, up again past some of them, down past k, and up to the first */
        for (int n = 1; n < 150; n++)
            for (int up = 1; up <= n; up++)
                for (int k = 0; k < 150; k++) sum += pow(b, 3) * pow(f, n + up + k + (n - up + k));
        assert_true(fabs(dual_deep_fraction((float)f, (float)b) / sum - 1) < 1e-4);
    }
}

/* Isotropic fibers send half of what they scatter to each side; no direction differs from another. */
static void isotropic_fibers(void **state)
{
    (void)state;
    struct dual_cloth c;
    dual_cloth_weave(&c, 0.8, NULL);
    for (int i = -8; i <= 8; i++) {
        struct dual_average a;
        float theta = 0.19f * (float)i, rgb[3];
        dual_average_at(&c.tables, 0, theta, &a);
        for (int k = 0; k < 3; k++)
            assert_true(fabsf(a.forward[k] - 0.4f) < 1e-4f && fabsf(a.backward[k] - 0.4f) < 1e-4f);
        for (int k = 0; k < 6; k++) {
            dual_blurred_at(&c.tables, 0, theta, 0.5f - 0.2f * (float)k, 0.5f * (float)k, 0.01f * (float)(k * k), rgb);
            assert_true(fabs((double)rgb[1] * M_PI * M_PI / 0.8 - 1) < 1e-3);
        }
    }
    dual_cloth_release(&c);
}

/* Energies and variances of narrow lobes against random samples of the model. The model is reciprocal in its angles, as
 * far as its lobes' scales are: samples of wi for a wo serve where S has neither. */
static void averages_against_samples(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct scattering_state *s;
    struct rng rng;
    enum { N = 400000 };
    dual_cloth_weave(&c, 0, dual_cloth_narrow);
    assert_int_equal(c.model->prepare(c.param, &s, NULL), STATUS_OK);
    rng_start(&rng, &(struct rng_key){.seed = 8}, 0, 0);
    for (int i = 0; i < 3; i++) {
        double theta_i = 0.4 * i, forward[3] = {0}, backward[3] = {0}, energy = 0, first = 0, second = 0;
        const float wi[3] = {(float)sin(theta_i), (float)cos(theta_i), 0};
        for (int k = 0; k < N; k++) { /* wo uniform in phi, and a mixture about -theta_i and all theta */
            double u = rng_double(&rng), phi = M_PI * rng_double(&rng), normal[2], theta;
            rng_normal_pair(&rng, normal);
            theta = u < 0.7 ? 0.15 * normal[0] - theta_i : M_PI * (rng_double(&rng) - 0.5);
            if (fabs(theta) >= M_PI_2) continue;
            double x = (theta + theta_i) / 0.15, pdf = 0.7 * exp(-0.5 * x * x) / (0.15 * sqrt(2 * M_PI)) + 0.3 / M_PI;
            float rgb[3];
            const float wo[3] = {(float)sin(theta), (float)(cos(theta) * cos(phi)), (float)(cos(theta) * sin(phi))};
            c.model->eval(s, wi, wo, rgb, NULL);
            double weight = 2 * M_PI * pow(cos(theta), 2) / pdf / N, ahead = 0;
            for (int a = 0; a < 3; a++) {
                forward[a] += weight * (double)rgb[a] * phi / M_PI;
                backward[a] += weight * (double)rgb[a] * (1 - phi / M_PI);
                ahead += weight * (double)rgb[a] * phi / M_PI;
            }
            energy += ahead;
            first += ahead * (theta + theta_i);
            second += ahead * (theta + theta_i) * (theta + theta_i);
        }
        struct dual_average a;
        dual_average_at(&c.tables, 0, (float)theta_i, &a);
        for (int k = 0; k < 3; k++) {
            assert_true(fabs((double)a.forward[k] - forward[k]) < 0.02 * forward[0]);
            assert_true(fabs((double)a.backward[k] - backward[k]) < 0.02 * forward[0]);
            assert_true(a.forward[k] > a.backward[k] && a.forward[k] + a.backward[k] < 1.001f);
        }
        double variance = second / energy - pow(first / energy, 2);
        assert_true(fabs((double)a.var_forward_rad2 - variance) < 0.05 * variance);
    }
    c.model->release(s);
    dual_cloth_release(&c);
}

/* What is blurred keeps its energy: all light that arrives over the fiber, spread as far as it can be, leaves as it
 * would have without that. And little blur leaves the mean over half a turn as it is. */
static void blurred_scattering(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct scattering_state *s;
    dual_cloth_weave(&c, 0, dual_cloth_wide);
    assert_int_equal(c.model->prepare(c.param, &s, NULL), STATUS_OK);
    for (int i = -2; i <= 2; i++) {
        double theta_d = 0.4 * i, direct[3] = {0}, blurred[3] = {0}, cell = M_PI / 90 * M_PI / 90;
        for (int t = 0; t < 90; t++)
            for (int p = 0; p < 180; p++) {
                double theta = M_PI * ((t + 0.5) / 90 - 0.5), phi = M_PI * (p + 0.5) / 90 - M_PI;
                float rgb[3];
                const float wi[3] = {(float)sin(theta_d), (float)cos(theta_d), 0};
                const float wo[3] = {(float)sin(theta), (float)(cos(theta) * cos(phi)), (float)(cos(theta) * sin(phi))};
                c.model->eval(s, wi, wo, rgb, NULL);
                for (int k = 0; k < 3; k++) direct[k] += cell * pow(cos(theta), 2) * (double)rgb[k];
                dual_blurred_at(&c.tables, 0, (float)theta_d, (float)theta, (float)phi, 0.005f, rgb);
                for (int k = 0; k < 3; k++) blurred[k] += cell * pow(cos(theta), 2) * (double)rgb[k];
            }
        for (int k = 0; k < 3; k++) assert_true(fabs(blurred[k] / direct[k] - 1) < 0.03);
    }
    c.model->release(s);
    dual_cloth_release(&c);
}

/* The lobe of the fibers behind has the energy A_b, however wide it is. */
static void deep_lobe_energy(void **state)
{
    (void)state;
    struct dual_cloth c;
    dual_cloth_weave(&c, 0, dual_cloth_wide);
    for (int i = -3; i <= 3; i++)
        for (int v = 0; v < 4; v++) {
            double theta_i = 0.35 * i, energy[3] = {0};
            struct dual_average a;
            dual_average_at(&c.tables, 0, (float)theta_i, &a);
            for (int t = 0; t < 720; t++) {
                double theta = M_PI * ((t + 0.5) / 720 - 0.5);
                float rgb[3];
                dual_deep_lobe(&c.tables, &a, (float)theta_i, (float)theta, 0.05f * (float)(v * v), rgb);
                for (int k = 0; k < 3; k++) energy[k] += M_PI * M_PI / 720 * pow(cos(theta), 2) * (double)rgb[k];
            }
            for (int k = 0; k < 3; k++) assert_true(fabs(energy[k] / (double)a.deep[k] - 1) < 0.03);
        }
    dual_cloth_release(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(deep_fraction_is_the_sum_of_its_series),
        cmocka_unit_test(isotropic_fibers),
        cmocka_unit_test(averages_against_samples),
        cmocka_unit_test(blurred_scattering),
        cmocka_unit_test(deep_lobe_energy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
