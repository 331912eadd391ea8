/* The search over the numbers of a cloth, on an analytic cloth with known numbers (fake_numbers.h). */
#include "optimizer/fit/descent/estimate_journal.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/fake_numbers.h"

#include <math.h>
#include <nlopt.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const double mid_cloth[FAKE_N_NUMBER] = {2.6, 0.62, 4.0};

static double number_of(const struct cloth_search_result *r, size_t k) { return r->joint.param[FAKE_N_PARAM + k]; }
static double number_se(const struct cloth_search_result *r, size_t k)
{
    return r->joint.uncertainty.se_param[FAKE_N_PARAM + k];
}

/* ---- derivatives ---- */

/* The mean of two iterations is a central difference, and falls short of the derivative by the square of the distance.
 * A number near its bound moves to the inside. */
static void test_columns(void **state)
{
    (void)state;
    struct fake_numbers x;
    fake_numbers_init(&x, mid_cloth, 1, 0.0, 0.0, 0.0);
    size_t n_path[FAKE_N_FIT];
    struct estimate e[2][FAKE_N_FIT];
    struct progress quiet = {0};
    double error[2] = {0.0, 0.0}, wall_s;
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 1000;
    for (int fine = 0; fine < 2; fine++) {
        x.numbers.difference = fine ? 0.05 : 0.1;
        for (uint32_t q = 0; q < 2; q++) {
            struct estimator_call call = {x.truth, n_path, q, REPLICA_FIT_A, true, false};
            assert_int_equal(x.estimator.run(x.estimator.context, &call, &quiet, e[q], &wall_s, NULL), STATUS_OK);
        }
        for (size_t i = 0; i < FAKE_N_FIT; i++) {
            for (size_t k = 0; k < FAKE_N_NUMBER; k++) {
                double up[3], down[3], moved[FAKE_N_UNKNOWN], h = 1e-5;
                memcpy(moved, x.truth, sizeof moved);
                moved[FAKE_N_PARAM + k] += h;
                fake_numbers_radiance(&x, i, moved, up);
                moved[FAKE_N_PARAM + k] -= 2.0 * h;
                fake_numbers_radiance(&x, i, moved, down);
                for (size_t c = 0; c < 3; c++) {
                    size_t at = c * FAKE_N_UNKNOWN + FAKE_N_PARAM + k;
                    double want = (up[c] - down[c]) / (2.0 * h), got = 0.5 * (e[0][i].jac[at] + e[1][i].jac[at]);
                    error[fine] = fmax(error[fine], fabs(got - want) / e[0][i].mean[c]);
                }
            }
        }
    }
    print_message("largest error of a derivative over the mean: %.2g, at half the distance %.2g\n", error[0], error[1]);
    assert_true(error[0] < 0.05 && error[1] < 0.3 * error[0] && error[1] > 0.2 * error[0]);
    x.truth[FAKE_N_PARAM] = 3.99;
    struct estimator_call call = {x.truth, n_path, 0, REPLICA_FIT_A, true, false};
    assert_int_equal(x.estimator.run(x.estimator.context, &call, &quiet, e[0], &wall_s, NULL), STATUS_OK);
    for (size_t i = 0; i < FAKE_N_FIT; i++)
        assert_true(isfinite(e[0][i].jac[FAKE_N_PARAM]) && e[0][i].jac[FAKE_N_PARAM] != 0.0);
    fake_numbers_release(&x);
}

/* A cloth whose mean is linear in its numbers, each with its own slope, besides what pairs of them do together. */
static status linear_mean(void *context, const double *number, const struct estimator_call *call,
                          const struct progress *progress, struct estimate *out, double *wall_s, struct error *err)
{
    const size_t n = *(const size_t *)context;
    (void)progress, (void)err;
    memset(out, 0, sizeof *out);
    out->n_path = call->n_path[0];
    for (size_t k = 0; k < n; k++)
        for (size_t c = 0; c < 3; c++) {
            out->mean[c] += (double)(1 + k + c) * number[k];
            out->mean[c] += 0.1 * number[k] * number[(k + 1) % n];
        }
    *wall_s = 0.0;
    return STATUS_OK;
}

/* Moves of all numbers at once give each number its own derivative, for every count of numbers, and pairs of them
 * cancel between two iterations. A fixed number takes no part. */
static void test_balanced_moves(void **state)
{
    (void)state;
    for (size_t n = 1; n <= CLOTH_MAX_FITTED; n++) {
        struct param_info info[CLOTH_MAX_FITTED];
        struct fit_parameter parameter[CLOTH_MAX_FITTED];
        struct cloth_estimator e;
        const struct cloth_source source = {&n, n, linear_mean, NULL};
        double number[CLOTH_MAX_FITTED] = {0}, wall_s;
        const size_t n_path[1] = {100000};
        struct estimate out[2];
        for (size_t k = 0; k < n; k++) {
            info[k] = (struct param_info){.name = "x", .kind = PARAM_SHAPE, .channel = -1, .lower = -1.0, .upper = 1.0};
            parameter[k] = (struct fit_parameter){-1.0, 1.0, 0.0, n > 1 && k == 0};
        }
        assert_int_equal(cloth_estimator_init(&e, &source, 0, 1, info, parameter, NULL), STATUS_OK);
        struct estimator all = cloth_estimator(&e);
        for (uint32_t i = 0; i < 2; i++) {
            struct estimator_call call = {number, n_path, i, REPLICA_FIT_A, true, false};
            assert_int_equal(all.run(all.context, &call, NULL, &out[i], &wall_s, NULL), STATUS_OK);
        }
        assert_true(cloth_estimator_n_moved(e.moves, n) <= CLOTH_MAX_MOVED);
        for (size_t k = 0; k < n; k++)
            for (size_t c = 0; c < 3; c++) {
                double got = 0.5 * (out[0].jac[c * n + k] + out[1].jac[c * n + k]);
                assert_true(fabs(got - (parameter[k].fixed ? 0.0 : (double)(1 + k + c))) < 1e-9);
            }
        cloth_estimator_release(&e);
    }
}

/* ---- the minimum, against another method ---- */

/* Objective at given numbers after a fit of the scattering parameters, as BOBYQA asks for it. */
static double profiled(unsigned n, const double *number, double *gradient, void *context)
{
    struct fake_numbers *x = context;
    struct fit_parameter parameter[FAKE_N_UNKNOWN];
    struct fit_problem problem = x->problem;
    struct fit_result *r = malloc(sizeof *r);
    (void)gradient;
    memcpy(parameter, x->parameter, sizeof parameter);
    for (size_t k = 0; k < FAKE_N_NUMBER; k++) {
        parameter[FAKE_N_PARAM + k].fixed = true;
        if (k < n) parameter[FAKE_N_PARAM + k].start = number[k];
    }
    problem.parameter = parameter;
    problem.report = NULL;
    x->numbers.number_derivatives = false;
    assert_int_equal(fit_run(x->search.method, &problem, &x->option, r, NULL), STATUS_OK);
    double f = r->objective.value;
    free(r);
    return f;
}

/* Without noise the joint fit of photographs that the model cannot match ends where BOBYQA (Powell 2009) ends on the
 * profiled objective. */
static void test_against_bobyqa(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    fake_numbers_init(&x, mid_cloth, 3, 0.0, 0.01, 0.03);
    x.parameter[FAKE_N_PARAM + 2].fixed = true;
    x.numbers.difference = 0.03;
    fake_numbers_run(&x, r);
    nlopt_opt o = nlopt_create(NLOPT_LN_BOBYQA, 2);
    double number[2] = {2.0, 0.5}, f;
    nlopt_set_lower_bounds(o, (const double[]){1.0, 0.3});
    nlopt_set_upper_bounds(o, (const double[]){4.0, 0.8});
    nlopt_set_initial_step(o, (const double[]){0.5, 0.1});
    nlopt_set_min_objective(o, profiled, &x);
    nlopt_set_maxeval(o, 60);
    nlopt_set_xtol_rel(o, 1e-3);
    assert_true(nlopt_optimize(o, number, &f) > 0);
    nlopt_destroy(o);
    print_message("flatness %.3f and %.3f, packing %.3f and %.3f, objective %.5f and %.5f\n", number_of(r, 0),
                  number[0], number_of(r, 1), number[1], r->joint.objective.value, f);
    assert_true(fabs(log(number_of(r, 0) / number[0])) < 0.3 * number_se(r, 0) / number[0] + 0.01);
    assert_true(fabs(number_of(r, 1) - number[1]) < 0.3 * number_se(r, 1) + 0.005);
    assert_true(r->joint.objective.value < 1.01 * f + 1e-6);
    fake_numbers_release(&x);
    free(r);
}

/* ---- noise, errors, what is not determined ---- */

enum { N_SEED = 24 };

static void test_recovery_and_errors(void **state)
{
    (void)state;
    struct cloth_search_result *r = malloc(sizeof *r);
    size_t n = 0, n_within = 0, n_wide = 0;
    double ratio = 0.0, square = 0.0;
    for (uint64_t seed = 0; seed < N_SEED; seed++) {
        struct fake_numbers x;
        struct fit_result alone;
        fake_numbers_init(&x, mid_cloth, 100 + seed, 1.0, 0.004, 0.0);
        x.problem.path_budget = 20000000;
        fake_numbers_run(&x, r);
        const struct uncertainty *u = &r->joint.uncertainty;
        for (size_t p = 0; p < FAKE_N_UNKNOWN; p++) {
            if (!u->determined[p] || u->at_bound[p]) continue;
            n++;
            double z = (r->joint.param[p] - x.truth[p]) / u->se_param[p];
            n_within += fabs(z) < 2.0;
            square += z * z;
        }
        assert_false(u->determined[FAKE_N_PARAM + 2]); /* hairs have no effect */
        assert_true(number_of(r, 2) > 0.0 && number_of(r, 2) < 10.0);
        /* the errors of colours contain the packing, so they are wider than on a cloth that is known */
        for (size_t k = 0; k < FAKE_N_NUMBER; k++) {
            x.parameter[FAKE_N_PARAM + k].fixed = true;
            x.parameter[FAKE_N_PARAM + k].start = x.truth[FAKE_N_PARAM + k];
        }
        x.problem.report = NULL;
        x.numbers.number_derivatives = false;
        assert_int_equal(fit_run(x.search.method, &x.problem, &x.option, &alone, NULL), STATUS_OK);
        ratio += log(u->se_param[4] / alone.uncertainty.se_param[4]) / N_SEED;
        n_wide += u->se_param[4] > alone.uncertainty.se_param[4];
        fake_numbers_release(&x);
    }
    double rms = sqrt(square / (double)n);
    print_message(
        "%zu of %zu determined unknowns within two standard errors (%.2f RMS); C_TT.g %.2f times the error on "
        "a known cloth\n",
        n_within, n, rms, exp(ratio));
    assert_true((double)n_within > 0.9 * (double)n && n > 10 * N_SEED);
    assert_true(rms > 0.5 && rms < 1.1);
    assert_true(n_wide >= N_SEED - 1 && exp(ratio) > 1.2);
    free(r);
}

/* What the measurements do not determine stays at its prior. */
static void test_prior_of_an_undetermined_number(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    fake_numbers_init(&x, mid_cloth, 5, 1.0, 0.01, 0.0);
    x.option.prior_mean[FAKE_N_PARAM + 2] = 6.0;
    x.option.prior_se[FAKE_N_PARAM + 2] = 0.5;
    fake_numbers_run(&x, r);
    print_message("hairs %.2f +- %.2f, prior 6 +- 0.5\n", number_of(r, 2), number_se(r, 2));
    assert_true(fabs(number_of(r, 2) - 6.0) < 0.2 && fabs(number_se(r, 2) - 0.5) < 0.05);
    fake_numbers_release(&x);
    free(r);
}

/* ---- extra starts ---- */

/* An extra start is a cloth of the screening with scattering parameters of its own, and the joint fit begins there if
 * it is the best. Values beyond the bounds are moved to them. */
static void test_extra_starts(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    fake_numbers_init(&x, mid_cloth, 11, 0.0, 0.0, 0.0);
    x.problem.max_iteration = 1; /* the joint fit stays where it begins */
    x.search.n_screen = 4;
    x.search.screen_expected = 4 * x.search.screen_budget;
    x.option.n_extra_start = 2;
    memcpy(x.option.extra_start[0], x.truth, sizeof x.truth);
    x.option.extra_start[0][FAKE_N_PARAM] = 9.0;
    memcpy(x.option.extra_start[1], x.truth, sizeof x.truth);
    fake_numbers_run(&x, r);
    assert_true(r->screened[0].number[1] == x.parameter[FAKE_N_PARAM + 1].start);
    assert_true(r->screened[1].number[0] == x.info[FAKE_N_PARAM].upper);
    for (size_t k = 0; k < FAKE_N_NUMBER; k++) assert_true(r->screened[2].number[k] == mid_cloth[k]);
    assert_true(r->screened[3].number[1] != mid_cloth[1] && r->screened[3].number[1] != r->screened[0].number[1]);
    assert_int_equal(r->i_best, 2);
    assert_true(r->screened[2].objective < 1e-3 * fmin(r->screened[0].objective, r->screened[3].objective));
    assert_int_equal(r->joint.n_start, 0);
    fake_numbers_release(&x);
    free(r);
}

/* A screening of one cloth is a fit to that of the start values, with whose parameters the joint fit begins. */
static void test_screening_of_one_cloth(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    double objective[2];
    for (size_t n_screen = 0; n_screen < 2; n_screen++) {
        fake_numbers_init(&x, mid_cloth, 11, 0.0, 0.0, 0.0);
        x.problem.max_iteration = 2;
        x.search.n_screen = n_screen;
        fake_numbers_run(&x, r);
        assert_int_equal(r->n_screen, n_screen);
        objective[n_screen] = r->joint.objective.value;
        fake_numbers_release(&x);
    }
    assert_true(objective[1] < 0.1 * objective[0]);
    free(r);
}

/* ---- the result without the numbers ---- */

/* The variance of a parameter is that of the final fit plus what the numbers add, which makes about the joint one. */
static void test_marginal(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    struct fit_result m;
    fake_numbers_init(&x, mid_cloth, 9, 0.0, 0.01, 0.0);
    x.option.global_gain_sd = 0.05;
    x.option.leader[5] = 4;
    x.option.ratio[5] = 0.5;
    fake_numbers_run(&x, r);
    cloth_search_marginal(&x.search, r, &m);
    assert_int_equal(m.uncertainty.n_param, FAKE_N_PARAM);
    assert_int_equal(m.unknown_uncertainty.n_param, FAKE_N_PARAM); /* eight leaders and the gain */
    assert_int_equal(r->joint.unknown_uncertainty.n_param, FAKE_N_UNKNOWN);
    assert_true(m.unknown[8] == r->final.unknown[FAKE_N_UNKNOWN - 1] && m.unknown[8] == m.nuisance.value[0]);
    assert_true(m.n_step == r->n_step && m.n_step > r->joint.n_step + r->final.n_step);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        double joint = r->joint.uncertainty.se_param[p], fixed = r->final.uncertainty.se_param[p],
               se = m.uncertainty.se_param[p];
        assert_true(m.param[p] == r->final.param[p] && r->final.uncertainty.at_bound[p] == m.uncertainty.at_bound[p]);
        assert_true(se >= fixed);
        if (m.uncertainty.determined[p]) assert_true(se > 0.7 * joint && se < 1.4 * joint);
        for (size_t q = 0; q < p; q++) {
            double cov = m.uncertainty.cov[p * FAKE_N_PARAM + q];
            assert_true(fabs(cov - m.uncertainty.cov[q * FAKE_N_PARAM + p]) <= 1e-9 * fabs(cov));
        }
    }
    print_message("error of C_TT.r: %.4f on the known cloth, %.4f with the numbers', %.4f in the joint fit\n",
                  r->final.uncertainty.se_param[3], m.uncertainty.se_param[3], r->joint.uncertainty.se_param[3]);
    assert_true(m.uncertainty.se_param[3] > 1.03 * r->final.uncertainty.se_param[3]);
    fake_numbers_release(&x);
    free(r);
}

/* What the screening takes more than expected is missing in the joint fit, which has its least budget all the same. */
static void test_screening_within_the_budget(void **state)
{
    (void)state;
    struct fake_numbers x;
    struct cloth_search_result *r = malloc(sizeof *r);
    for (int least = 0; least < 2; least++) {
        uint64_t screened = 0;
        fake_numbers_init(&x, mid_cloth, 13, 1.0, 0.01, 0.0);
        const double cost = cloth_estimator_cost(x.numbers.moves, FAKE_N_NUMBER);
        x.search.n_screen = 3;
        x.search.screen_budget = 300000;
        x.search.screen_expected = 0;
        x.search.least_joint_budget = least ? x.problem.path_budget : 0;
        fake_numbers_run(&x, r);
        for (size_t i = 0; i < r->n_screen; i++) screened += r->screened[i].n_path;
        double whole = (double)x.problem.path_budget, joint = (double)r->joint.n_path;
        assert_true((double)screened > 0.1 * whole);
        assert_true(least ? joint > 0.9 * whole : joint < 1.05 * (whole - (double)screened / cost));
        fake_numbers_release(&x);
    }
    free(r);
}

/* ---- interruption ---- */

static void test_resume(void **state)
{
    struct fake_numbers x;
    struct cloth_search_result *want = malloc(sizeof *want), *got = malloc(sizeof *got);
    const char *path = scratch_path(state, "cloth.journal");
    fake_numbers_init(&x, mid_cloth, 13, 1.0, 0.01, 0.0);
    x.search.n_screen = 2;
    x.search.screen_expected = 2 * x.search.screen_budget;
    x.problem.max_iteration = 3;
    fake_numbers_run(&x, want);
    size_t n_call = x.cloth.n_call;
    for (size_t cut = 1; cut < n_call; cut += 3) {
        struct estimate_journal *j = NULL;
        unlink(path);
        for (int round = 0; round < 2; round++) {
            x.cloth.n_call = x.n_reported = 0;
            x.cloth.fail_after = round == 0 ? cut : 0;
            assert_int_equal(estimate_journal_open(path, 7, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
            struct estimator through = estimate_journal_estimator(j);
            x.problem.estimator = &through;
            status s = cloth_search_run(&x.search, got, NULL);
            assert_int_equal(s, round == 0 ? STATUS_CANCELLED : STATUS_OK);
            estimate_journal_close(j);
        }
        assert_true(x.cloth.n_call < n_call);
        assert_memory_equal(got, want, sizeof *got);
    }
    fake_numbers_release(&x);
    free(want);
    free(got);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_columns),
        cmocka_unit_test(test_balanced_moves),
        cmocka_unit_test(test_against_bobyqa),
        cmocka_unit_test(test_recovery_and_errors),
        cmocka_unit_test(test_prior_of_an_undetermined_number),
        cmocka_unit_test(test_extra_starts),
        cmocka_unit_test(test_screening_of_one_cloth),
        cmocka_unit_test(test_marginal),
        cmocka_unit_test(test_screening_within_the_budget),
        cmocka_unit_test_setup_teardown(test_resume, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
