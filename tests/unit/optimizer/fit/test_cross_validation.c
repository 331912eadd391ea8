/* Cross-validation of a fit on the analytic cloth: the leave-one-out errors that follow from the pooled linear model
 * against those of true fits without the row. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/descent/cross_validation.h"
#include "tests/support/descent_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void run(const struct descent_fixture *x, struct fit_result *r)
{
    struct error err = {0};
    if (descent_find(method_gauss_newton.id)->run(&x->problem, r, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* Fits photographs with a relative error of rel_noise, which a model cannot explain. noise: of the tracing. */
static void set_up(struct descent_fixture *x, uint64_t seed, uint64_t path_budget, double noise, double rel_noise)
{
    descent_fixture_init(x, seed, path_budget);
    x->cloth.noise = noise;
    x->problem.report = NULL;
    observation_set_release(&x->observation);
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->truth, rel_noise, seed, &x->observation), STATUS_OK);
    for (size_t i = 0; i < x->observation.n; i++) memset(x->observation.item[i].se_rgb, 0, 3 * sizeof(double));
}

/* Rows i and i + N_DIRECTION have the same directions and two rotations of the cloth. */
enum { N_DIRECTION = FAKE_N_FIT / 2 };

static double square_error(const struct observation *o, const double *param)
{
    double square = 0.0, rgb[3];
    fake_radiance(&o->configuration, param, rgb, NULL);
    for (size_t c = 0; c < 3; c++) square += pow(rgb[c] - o->mean_rgb[c], 2.0);
    return square * objective_relative_weight(o);
}

/* Fits the rows of all directions but one. Returns the sum of the squared relative errors of the two rows left out. */
static double refit_without(const struct descent_fixture *all, size_t direction)
{
    struct descent_fixture x = *all;
    struct fit_result r;
    struct error err = {0};
    observation_set_init(&x.observation);
    for (size_t j = 0; j < all->observation.n; j++) {
        if (j % N_DIRECTION == direction) continue;
        x.cloth.configuration[x.observation.n] = all->cloth.configuration[j];
        assert_int_equal(observation_set_append(&x.observation, &all->observation.item[j], &err), STATUS_OK);
    }
    x.cloth.n_configuration = x.observation.n;
    x.estimator = fake_estimator(&x.cloth);
    x.problem.observation = &x.observation;
    x.problem.estimator = &x.estimator;
    run(&x, &r);
    observation_set_release(&x.observation);
    return square_error(&all->observation.item[direction], r.param) +
           square_error(&all->observation.item[direction + N_DIRECTION], r.param);
}

static void compare(double noise, uint64_t path_budget, double tolerance)
{
    enum { SEEDS = 4 };
    double predicted = 0.0, refitted = 0.0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        struct descent_fixture x;
        struct fit_result r;
        double sum = 0.0;
        set_up(&x, seed, path_budget, noise, 0.05);
        run(&x, &r);
        const struct cross_validation *v = &r.cross_validation;
        assert_int_equal(v->n_fold, N_DIRECTION);
        assert_int_equal(v->n_row, FAKE_N_FIT);
        for (size_t i = 0; i < N_DIRECTION; i++) sum += refit_without(&x, i);
        sum /= 3.0 * FAKE_N_FIT;
        print_message("seed %u: fitted %.4f, left out: linear model %.4f +- %.4f, fitted anew %.4f\n", (unsigned)seed,
                      r.objective.rel_rms, v->rel_rms, v->rel_rms_se, sqrt(sum));
        assert_true(v->rel_rms > r.objective.rel_rms && v->rel_rms_se > 0.0 && v->rel_rms_se < v->rel_rms);
        predicted += v->rel_square / SEEDS;
        refitted += sum / SEEDS;
        observation_set_release(&x.observation);
    }
    print_message("all seeds: linear model %.4f, fitted anew %.4f\n", sqrt(predicted), sqrt(refitted));
    assert_true(fabs(sqrt(predicted / refitted) - 1.0) < tolerance);
}

static void test_without_noise_of_tracing(void **state)
{
    (void)state;
    compare(0.0, 0, 0.15);
}

static void test_with_noise_of_tracing(void **state)
{
    (void)state;
    compare(1.0, 2000000, 0.15);
}

/* Four rows leave nine numbers for nine parameters when one is left out, which is too few; five leave twelve. */
static void test_too_few_rows(void **state)
{
    (void)state;
    static const struct {
        size_t n_row, n_fold;
    } expected[] = {{1, 0}, {3, 0}, {4, 0}, {5, 5}, {7, 7}, {8, 8}, {9, 8}};
    for (size_t k = 0; k < sizeof expected / sizeof expected[0]; k++) {
        struct descent_fixture x;
        struct fit_result r;
        set_up(&x, 1, 200000, 1.0, 0.05);
        x.cloth.n_configuration = x.observation.n = expected[k].n_row;
        x.estimator = fake_estimator(&x.cloth);
        run(&x, &r);
        assert_int_equal(r.cross_validation.n_fold, expected[k].n_fold);
        assert_int_equal(r.cross_validation.n_row, expected[k].n_fold > 0 ? expected[k].n_row : 0);
        observation_set_release(&x.observation);
    }
}

/* A model that cannot change its lobe widths, which are wrong, predicts rows that were left out worse beyond doubt. */
static void test_difference_of_two_models(void **state)
{
    (void)state;
    struct descent_fixture x;
    struct fit_result free_widths, wrong_widths;
    double se, more;
    set_up(&x, 1, 2000000, 1.0, 0.02);
    run(&x, &free_widths);
    for (size_t p = 6; p < FAKE_N_PARAM; p++) {
        x.parameter[p].fixed = true;
        x.parameter[p].start = fake_param[p].upper;
    }
    run(&x, &wrong_widths);
    more = cross_validation_difference(&free_widths.cross_validation, &wrong_widths.cross_validation, &se);
    print_message("free %.4f, wrong widths %.4f, difference of the squares %.4g +- %.2g\n",
                  free_widths.cross_validation.rel_rms, wrong_widths.cross_validation.rel_rms, more, se);
    assert_true(more > 2.0 * se && se > 0.0);
    assert_true(fabs(more - (wrong_widths.cross_validation.rel_square - free_widths.cross_validation.rel_square)) <
                1e-12);
    observation_set_release(&x.observation);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_without_noise_of_tracing),
        cmocka_unit_test(test_with_noise_of_tracing),
        cmocka_unit_test(test_too_few_rows),
        cmocka_unit_test(test_difference_of_two_models),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
