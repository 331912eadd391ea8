/* Every method of the registry recovers a known cloth, respects fixed parameters and bounds, and gives the same bits
 * when it is repeated. */
#include "base/catalogue/method_catalogue.h"
#include "base/option_id.h"
#include "optimizer/fit/descent/bounded_quadratic.h"
#include "optimizer/fit/descent/descent_methods.h"
#include "tests/support/descent_fixture.h"
#include "tests/support/general_methods.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The estimator of the fixture, with a count of calls with plain paths and with guided paths. */
struct counted {
    struct estimator inner;
    size_t n_plain, n_probing;
};

static status counted_run(void *context, const struct estimator_call *call, const struct progress *progress,
                          struct estimate *out, double *wall_s, struct error *err)
{
    struct counted *c = context;
    ++*(call->plain_paths ? &c->n_plain : &c->n_probing);
    return c->inner.run(c->inner.context, call, progress, out, wall_s, err);
}

/* The published method uses plain paths, as published; ours uses guided paths too. */
static void test_kind_of_paths(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct descent_fixture x;
        struct fit_result r;
        descent_fixture_init(&x, 1, 400000);
        struct counted c = {.inner = x.estimator};
        struct estimator e = {&c, x.estimator.n_configuration, x.estimator.n_param, counted_run};
        x.problem.estimator = &e;
        descent_fixture_run(&x, *m, &r);
        bool published = (*m)->info == &method_published_sgd;
        assert_true(c.n_plain + c.n_probing > 0 && (published ? c.n_probing : c.n_plain) == 0);
        observation_set_release(&x.observation);
    }
}

/* The estimator of the fixture, each call of which reports its own progress from 0 to 1, and the progress of the fit
 * that is reported. */
struct heard {
    struct estimator inner;
    double fraction, after_first;
    size_t n_call;
};

static status run_with_progress(void *context, const struct estimator_call *call, const struct progress *progress,
                                struct estimate *out, double *wall_s, struct error *err)
{
    struct heard *h = context;
    progress_report(progress, 0.0);
    status s = h->inner.run(h->inner.context, call, progress, out, wall_s, err);
    progress_report(progress, 1.0);
    if (h->n_call++ == 0) h->after_first = h->fraction;
    return s;
}

static void hear(void *context, double fraction)
{
    struct heard *h = context;
    assert_true(fraction >= h->fraction - 1e-9 && fraction <= 1.0);
    h->fraction = fraction;
}

/* The end of one rendering must not be reported as the end of the fit. */
static void test_progress(void **state)
{
    (void)state;
    static const uint64_t budget[] = {4000000, 200000}; /* the second is less than published_sgd.v1 needs */
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        for (size_t i = 0; i < 2; i++) {
            struct descent_fixture x;
            struct fit_result r;
            descent_fixture_init(&x, 1, budget[i]);
            struct heard h = {.inner = x.estimator};
            struct estimator e = {&h, x.estimator.n_configuration, x.estimator.n_param, run_with_progress};
            struct progress progress = {.report = hear, .context = &h};
            x.problem.estimator = &e;
            x.problem.progress = &progress;
            descent_fixture_run(&x, *m, &r);
            print_message("%s: progress %.3f after the first of %zu renderings, %.3f at the end\n", (*m)->info->id,
                          h.after_first, h.n_call, h.fraction);
            assert_true(h.after_first > 0.0 && h.after_first < 4.0 / (double)h.n_call);
            assert_true(h.fraction > 0.9);
            observation_set_release(&x.observation);
        }
    }
}

/* The fractions that a fit reports, and its paths at each step. */
struct course {
    status (*inner)(void *context, const struct fit_step *step, struct error *err);
    void *context;
    double fraction, n_path[64], at[64];
    size_t n;
};

static void follow(void *context, double fraction) { ((struct course *)context)->fraction = fraction; }

static status keep_step(void *context, const struct fit_step *step, struct error *err)
{
    struct course *k = context;
    if (k->n < 64) {
        k->n_path[k->n] = (double)step->n_path_total;
        k->at[k->n++] = k->fraction;
    }
    return k->inner(k->context, step, err);
}

/* Runs a fit that ends before its budget, by its noise or at a misfit, and follows its fraction. Returns its paths. */
static double run_to_an_early_end(bool misfit, double usual_path, struct course *k)
{
    struct descent_fixture x;
    struct fit_result r;
    descent_fixture_init(&x, 3, 0);
    for (size_t i = 0; i < x.observation.n; i++)
        for (size_t c = 0; c < 3; c++) {
            struct observation *o = &x.observation.item[i];
            if (misfit)
                o->mean_rgb[c] *= (i + c) % 2 ? 1.2 : 0.9; /* of which no parameters make every other row */
            else
                o->se_rgb[c] *= 10.0; /* large enough for tracing to become as good as the photographs */
        }
    *k = (struct course){.inner = x.problem.report, .context = x.problem.report_context};
    const struct progress progress = {.report = follow, .context = k};
    x.problem.report = keep_step;
    x.problem.report_context = k;
    x.problem.progress = &progress;
    x.problem.usual_path = usual_path;
    descent_fixture_run(&x, descent_find("gauss_newton.v1"), &r);
    print_message("%s: %zu steps, %.2f of the budget, stop %d\n", misfit ? "misfit" : "noise", r.n_step,
                  (double)r.n_path / (double)method_gauss_newton.default_path_budget, (int)r.stop);
    assert_true((double)r.n_path < 0.85 * (double)method_gauss_newton.default_path_budget);
    observation_set_release(&x.observation);
    return (double)r.n_path;
}

/* A fit that ends long before its budget knows so after half of its paths; told what such fits take, after a tenth. */
static void test_the_fraction_of_an_early_end(void **state)
{
    (void)state;
    for (int misfit = 0; misfit < 2; misfit++) {
        struct course k;
        double usual = 0.0;
        for (int told = 0; told < 2; told++) {
            const double n_path = run_to_an_early_end(misfit, usual, &k), from = told ? 0.1 : 0.45;
            assert_true(!told || n_path == usual); /* it changes nothing else */
            for (size_t i = 0; i < k.n; i++) {
                double share = k.n_path[i] / n_path;
                print_message("  %.2f of the paths: fraction %.2f\n", share, k.at[i]);
                if (share > from) assert_true(k.at[i] > 0.6 * share && k.at[i] < 1.6 * share);
            }
            usual = n_path;
        }
    }
}

/* With a smaller budget a method uses as many paths as it states as its least budget. With its least budget it does not
 * use more. */
static void test_least_budget(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        for (int bounded = 0; bounded < 2; bounded++) {
            struct descent_fixture x;
            struct fit_result r;
            descent_fixture_init(&x, 1, 1000);
            if (bounded) x.parameter[1].lower = 1.5 * x.parameter[0].lower; /* a channel with a curve of its own */
            uint64_t least = (*m)->least_budget(&x.problem);
            descent_fixture_run(&x, *m, &r);
            print_message("%s: least budget %.0f, takes %.0f of 1000\n", (*m)->info->id, (double)least,
                          (double)r.n_path);
            assert_true(r.n_path <= least && (double)r.n_path > 0.9 * (double)least);
            x.problem.path_budget = least;
            descent_fixture_run(&x, *m, &r);
            assert_true(r.n_path <= least);
            observation_set_release(&x.observation);
        }
    }
}

static void test_every_method_recovers(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct descent_fixture x;
        struct fit_result r;
        descent_fixture_init(&x, 1, 400000000);
        descent_fixture_run(&x, *m, &r);
        double error = fake_rel_rms(&x.cloth, 0, FAKE_N_FIT, r.param, x.truth);
        print_message("%s: relative RMS error %.4f, objective %.4g -> %.4g, %zu steps\n", (*m)->info->id, error,
                      x.first, r.objective.value, r.n_step);
        assert_true(error < 0.1);
        assert_true(r.objective.value < 0.1 * x.first);
        observation_set_release(&x.observation);
    }
}

static void test_fixed_and_bounds(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct descent_fixture x;
        struct fit_result r;
        descent_fixture_init(&x, 2, 3000000);
        x.parameter[6] = (struct fit_parameter){fake_param[6].lower, fake_param[6].upper, x.truth[6], true};
        x.parameter[3].upper = 0.86; /* below the truth: the fit must end at the bound and stay there */
        x.problem.max_iteration = 25;
        descent_fixture_run(&x, *m, &r);
        assert_true(r.param[6] == x.truth[6] && r.uncertainty.se_param[6] == 0.0);
        assert_true(r.param[3] <= 0.86 && r.param[3] > 0.8);
        observation_set_release(&x.observation);
    }
}

static void test_every_method_repeats(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct descent_fixture x;
        struct fit_result a, b;
        descent_fixture_init(&x, 4, 1500000);
        x.problem.max_iteration = 6;
        descent_fixture_run(&x, *m, &a);
        descent_fixture_run(&x, *m, &b);
        assert_memory_equal(&a, &b, sizeof a);
        observation_set_release(&x.observation);
    }
}

/* The inner problem against exhaustive search over active sets in two dimensions. */
static void test_bounded_quadratic(void **state)
{
    (void)state;
    const double h[4] = {2.0, 0.9, 0.9, 1.0}, lower[2] = {-1.0, -0.5}, upper[2] = {0.5, 1.0};
    for (int k = 0; k < 64; k++) {
        double g[2] = {4.0 * cos(k * 0.1), 4.0 * sin(k * 0.1)}, y[2], best = INFINITY;
        assert_int_equal(bounded_quadratic(h, g, lower, upper, 2, y, NULL), STATUS_OK);
        for (int a = 0; a <= 300; a++) {
            for (int b = 0; b <= 300; b++) {
                double u = lower[0] + (upper[0] - lower[0]) * a / 300.0,
                       v = lower[1] + (upper[1] - lower[1]) * b / 300.0;
                best = fmin(best, g[0] * u + g[1] * v + 0.5 * (h[0] * u * u + 2.0 * h[1] * u * v + h[3] * v * v));
            }
        }
        double value =
            g[0] * y[0] + g[1] * y[1] + 0.5 * (h[0] * y[0] * y[0] + 2.0 * h[1] * y[0] * y[1] + h[3] * y[1] * y[1]);
        assert_true(value <= best + 1e-9 && value > best - 1e-3);
        assert_true(y[0] >= lower[0] && y[0] <= upper[0] && y[1] >= lower[1] && y[1] <= upper[1]);
    }
    const double zero[4] = {0};
    double g[2] = {1.0, 0.0}, y[2];
    assert_int_equal(bounded_quadratic(zero, g, lower, upper, 2, y, NULL), STATUS_OK);
    assert_true(fabs(y[0] - lower[0]) < 1e-9);
    g[0] = NAN;
    assert_int_equal(bounded_quadratic(h, g, lower, upper, 2, y, NULL), STATUS_NUMERIC);
}

static void test_bad_problems(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct descent_fixture x;
        struct fit_result r;
        struct error err = {0};
        descent_fixture_init(&x, 1, 100000);
        x.parameter[0].start = 5.0;
        assert_int_equal((*m)->run(&x.problem, &r, &err), STATUS_INVALID);
        assert_string_equal(err.field, OPTION_START);
        x.parameter[0].start = 0.1;
        x.estimator.n_configuration = 3;
        assert_int_equal((*m)->run(&x.problem, &r, &err), STATUS_INVALID);
        observation_set_release(&x.observation);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kind_of_paths),
        cmocka_unit_test(test_progress),
        cmocka_unit_test(test_the_fraction_of_an_early_end),
        cmocka_unit_test(test_least_budget),
        cmocka_unit_test(test_every_method_recovers),
        cmocka_unit_test(test_fixed_and_bounds),
        cmocka_unit_test(test_every_method_repeats),
        cmocka_unit_test(test_bounded_quadratic),
        cmocka_unit_test(test_bad_problems),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
