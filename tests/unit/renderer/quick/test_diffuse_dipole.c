/* The dipole: closed forms against quadrature, samples against their distribution, and the medium that is found again.
 */
#include "base/rng.h"
#include "renderer/quick/diffuse_dipole.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const double absorption[4] = {3.0, 0.5, 0.02, 0.001}, scattering[4] = {2.0, 4.0, 7.0, 11.0};

/* Integral of R_d r^power over the plane out to `most`, with r = z exp(x). */
static double integral(const struct diffuse_dipole *d, double power, double most)
{
    enum { N = 40000 };
    double from = log(1e-6 * d->depth_mm), step = (log(most) - from) / N, sum = 0.0;
    for (int i = 0; i < N; i++) {
        double r = exp(from + step * (i + 0.5));
        sum += 2.0 * M_PI * r * r * step * pow(r, power) * diffuse_dipole_at(d, r);
    }
    return sum;
}

static void closed_forms(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct diffuse_dipole d = diffuse_dipole_of(absorption[i], scattering[i]);
        double all = integral(&d, 0.0, 60.0 / d.decay_per_mm), second = integral(&d, 2.0, 60.0 / d.decay_per_mm);
        assert_true(fabs(d.decay_per_mm / sqrt(3.0 * absorption[i] * (absorption[i] + scattering[i])) - 1.0) < 1e-12);
        assert_true(fabs(all / diffuse_dipole_reflectance(&d) - 1.0) < 1e-5);
        assert_true(fabs(second / all / diffuse_dipole_mean_square_mm2(&d) - 1.0) < 1e-5);
    }
}

/* A deep medium that absorbs nothing gives all light back, and one that scatters nothing gives none. */
static void limits(void **state)
{
    (void)state;
    struct diffuse_dipole lossless = diffuse_dipole_of(0.0, 5.0), dark = diffuse_dipole_of(5.0, 1e-9);
    assert_true(fabs(diffuse_dipole_reflectance(&lossless) - 1.0) < 1e-12);
    assert_true(diffuse_dipole_reflectance(&dark) < 1e-9);
}

/* Reflectance and mean square distance name one medium; twice the density makes it half as deep. */
static void the_medium_is_found_again(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct diffuse_dipole d = diffuse_dipole_of(absorption[i], scattering[i]);
        double reflectance = diffuse_dipole_reflectance(&d), square = diffuse_dipole_mean_square_mm2(&d);
        struct diffuse_dipole again = diffuse_dipole_match(reflectance, square),
                              denser = diffuse_dipole_of(2.0 * absorption[i], 2.0 * scattering[i]);
        assert_true(fabs(again.albedo - d.albedo) < 1e-9 && fabs(again.depth_mm / d.depth_mm - 1.0) < 1e-6);
        assert_true(fabs(again.decay_per_mm / d.decay_per_mm - 1.0) < 1e-6);
        assert_true(fabs(diffuse_dipole_reflectance(&denser) - reflectance) < 1e-12);
        assert_true(fabs(4.0 * diffuse_dipole_mean_square_mm2(&denser) / square - 1.0) < 1e-12);
    }
}

static void samples_follow_the_dipole(void **state)
{
    (void)state;
    enum { N = 100000, N_CELL = 40 };
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 3}, 0, 0);
    for (int i = 0; i < 4; i++) {
        struct diffuse_dipole d = diffuse_dipole_of(absorption[i], scattering[i]);
        double count[N_CELL] = {0}, expected[N_CELL], before = 0.0, n_degree, all = diffuse_dipole_reflectance(&d);
        for (int k = 0; k < N; k++) {
            double u = rng_double(&rng), x = diffuse_dipole_sample(&d, u, rng_double(&rng)) / d.depth_mm;
            size_t cell = (size_t)(N_CELL * x / (1.0 + x));
            count[cell < N_CELL ? cell : N_CELL - 1] += 1.0;
        }
        for (int k = 0; k < N_CELL; k++) {
            double x = (k + 1.0) / N_CELL,
                   below = k + 1 < N_CELL ? integral(&d, 0.0, d.depth_mm * x / (1.0 - x)) / all : 1.0;
            expected[k] = N * (below - before);
            before = below;
        }
        double x2 = chi_square_statistic(count, expected, N_CELL, &n_degree);
        assert_true(chi_square_tail(x2, n_degree) > 1e-4);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_forms),
        cmocka_unit_test(limits),
        cmocka_unit_test(the_medium_is_found_again),
        cmocka_unit_test(samples_follow_the_dipole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
