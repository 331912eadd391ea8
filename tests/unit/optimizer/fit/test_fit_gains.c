/* Nuisance terms of a fit: one gain and stray light of all photographs, or a gain of each. */
#include "base/option_id.h"
#include "tests/support/fit_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* All photographs are too bright by one factor and have glare. */
static void test_global_gain_and_stray_light(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result r;
    const double gain = 1.06, stray = 0.01;
    fit_fixture_init(&x, fit_fixture_mid_range, 9, true, 0.005);
    for (size_t i = 0; i < x.observation.n; i++)
        for (int c = 0; c < 3; c++)
            x.observation.item[i].mean_rgb[c] = gain * x.observation.item[i].mean_rgb[c] + stray;
    x.option.global_gain_sd = 0.1;
    x.option.stray_light_sd = 0.02;
    fit_fixture_run(&x, &r);
    assert_int_equal(r.nuisance.n, 2);
    assert_string_equal(r.nuisance.name[0], NUISANCE_GAIN);
    assert_string_equal(r.nuisance.name[1], NUISANCE_STRAY_LIGHT);
    print_message("gain %.4f +- %.4f (1.06), stray light %.4f +- %.4f (0.01)\n", r.nuisance.value[0], r.nuisance.se[0],
                  r.nuisance.value[1], r.nuisance.se[1]);
    assert_true(fabs(r.nuisance.value[0] - gain) < 3.0 * r.nuisance.se[0] + 1e-3);
    assert_true(fabs(r.nuisance.value[1] - stray) < 3.0 * r.nuisance.se[1] + 1e-3);
    assert_true(r.nuisance.se[0] > 0.0 && r.nuisance.se[0] <= 0.11);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        assert_true(fabs(r.param[p] - x.truth[p]) < 4.0 * r.uncertainty.se_param[p]);
    assert_true(x.last_gain != 0.0);
    fit_fixture_release(&x);
}

/* Photographs have exposure errors of 8 %. A fit with a gain for each is more accurate, and its standard errors are
 * right. */
static void test_gain_of_each_photograph(void **state)
{
    (void)state;
    enum { N_SEED = 12 };
    double error[2] = {0.0, 0.0};
    size_t n_inside = 0, n_judged = 0;
    for (uint64_t seed = 1; seed <= N_SEED; seed++) {
        for (int marginal = 0; marginal < 2; marginal++) {
            struct fit_fixture x;
            struct fit_result r;
            fit_fixture_init(&x, fit_fixture_mid_range, seed, false, 0.005);
            struct rng_key key = {.seed = 100 + seed};
            struct rng rng;
            rng_start(&rng, &key, 0, 0);
            for (size_t i = 0; i < x.observation.n; i++) {
                double z[2];
                rng_normal_pair(&rng, z);
                for (int c = 0; c < 3; c++) x.observation.item[i].mean_rgb[c] *= exp(0.08 * z[0]);
            }
            if (marginal == 1) x.option.photograph_gain_sd = 0.08;
            fit_fixture_run(&x, &r);
            error[marginal] += pow(fake_rel_rms(&x.cloth, 0, FAKE_N_FIT, r.param, x.truth), 2.0) / N_SEED;
            for (size_t p = 0; p < FAKE_N_PARAM && marginal == 1; p++) {
                if (!r.uncertainty.determined[p] || r.uncertainty.at_bound[p]) continue;
                n_judged++;
                n_inside += fabs(r.param[p] - x.truth[p]) < 2.0 * r.uncertainty.se_param[p];
            }
            fit_fixture_release(&x);
        }
    }
    print_message("error of the radiances: %.2f %% without, %.2f %% with a gain for each photograph; truth inside 2 "
                  "standard errors for %zu of %zu\n",
                  100.0 * sqrt(error[0]), 100.0 * sqrt(error[1]), n_inside, n_judged);
    assert_true(error[1] < error[0]);
    assert_true((double)n_inside > 0.85 * (double)n_judged);
}

static void test_photograph_gain_estimate(void **state)
{
    (void)state;
    struct observation o = {.mean_rgb = {0.33, 0.44, 0.55}, .weight = 1.0};
    struct estimate e = {.mean = {0.3, 0.4, 0.5}};
    double gain, se;
    nuisance_photograph_gain(&o, &e, &e, 1.0, 1e-6, &gain, &se);
    assert_true(fabs(gain - 1.1) < 1e-4 && se < 1e-2);
    nuisance_photograph_gain(&o, &e, &e, 1e-3, 1.0, &gain, &se); /* only the prior determines it */
    assert_true(fabs(gain - 1.0) < 1e-4 && fabs(se / 1e-3 - 1.0) < 1e-3);
}

/* The channels share their noise, and the prior of the gain is weak. With one gain for both replicas the product of the
 * residuals would be too small by the variance of their mean. With a gain for each replica it is unbiased. */
static void test_own_gains_leave_no_bias(void **state)
{
    (void)state;
    enum { ROUND = 20000 };
    const double noise = 0.02, mean[3] = {0.3, 0.4, 0.5},
                 off[3] = {0.01, 0.0, -0.01}; /* relative errors that no gain can remove */
    double sum = 0.0, square = 0.0, exact = 0.0;
    struct observation o = {.weight = 1.0};
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 12}, 0, 0);
    for (int c = 0; c < 3; c++) o.mean_rgb[c] = 1.1 * mean[c] * (1.0 + off[c]);
    for (int round = -1; round < ROUND; round++) { /* the first without noise */
        struct estimate e[2];
        double normal[2], product = 0.0;
        rng_normal_pair(&rng, normal);
        for (int q = 0; q < 2; q++) {
            for (int c = 0; c < 3; c++) {
                e[q].mean[c] = mean[c] * (1.0 + (round < 0 ? 0.0 : noise * normal[q]));
                e[q].var[c] = noise * noise * mean[c] * mean[c];
            }
            nuisance_apply_own_gain(&o, &e[q], 1.0, 1e-4, &e[q]);
        }
        for (int c = 0; c < 3; c++) product += (e[0].mean[c] - o.mean_rgb[c]) * (e[1].mean[c] - o.mean_rgb[c]);
        if (round < 0)
            exact = product;
        else
            sum += product / ROUND, square += product * product / ROUND;
    }
    double se = sqrt((square - sum * sum) / ROUND);
    print_message("squared error with own gains %.3g +- %.1g, without noise %.3g\n", sum, se, exact);
    assert_true(exact > 1e-5 && fabs(sum - exact) < 4.0 * se + 0.02 * exact);
    assert_true(4.0 * se < 0.1 * exact);
}

/* Nuisance terms count as unknowns. */
static void test_too_many_unknowns(void **state)
{
    (void)state;
    struct fit_option o;
    struct fit_layout l;
    struct error err = {0};
    struct param_info info[FIT_MAX_PARAM];
    struct fit_parameter p[FIT_MAX_PARAM];
    fit_option_init(&o);
    for (size_t i = 0; i < FIT_MAX_PARAM; i++) {
        info[i] = fake_param[0];
        p[i] = (struct fit_parameter){0.1, 0.9, 0.5, false};
    }
    assert_int_equal(fit_layout_init(&l, info, p, FIT_MAX_PARAM, &o, &err), STATUS_OK);
    o.global_gain_sd = 0.1;
    assert_int_equal(fit_layout_init(&l, info, p, FIT_MAX_PARAM, &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_NUISANCE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_global_gain_and_stray_light), cmocka_unit_test(test_gain_of_each_photograph),
        cmocka_unit_test(test_photograph_gain_estimate),    cmocka_unit_test(test_own_gains_leave_no_bias),
        cmocka_unit_test(test_too_many_unknowns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
