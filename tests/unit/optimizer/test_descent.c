/* Every method of the registry: it recovers a known cloth, honours fixed parameters and bounds, repeats itself bit by
 * bit, and resumes bit by bit from its journal wherever it was cut. */
#include "base/catalogue/method_catalogue.h"
#include "base/durable.h"
#include "base/option_id.h"
#include "optimizer/fit/descent/descent.h"
#include "optimizer/fit/descent/descent_methods.h"
#include "optimizer/fit/descent/estimate_journal.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static const double mid_range[FAKE_N_PARAM] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5.0, 15.0, 20.0};

struct fixture {
    struct fake_cloth cloth;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct fit_problem problem;
    double truth[FAKE_N_PARAM], first, last;
    size_t n_reported;
};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct fixture *x = context;
    (void)err;
    assert_int_equal(step->step, x->n_reported);
    if (x->n_reported == 0) x->first = step->objective.value;
    x->last = step->objective.value;
    x->n_reported++;
    assert_true(isfinite(step->objective.value) && step->objective.se > 0.0);
    for (size_t p = 0; p < step->n_param; p++)
        assert_true(step->param[p] >= fake_param[p].lower && step->param[p] <= fake_param[p].upper);
    return STATUS_OK;
}

static void setup(struct fixture *x, uint64_t seed, uint64_t path_budget)
{
    memset(x, 0, sizeof *x);
    fake_cloth_init(&x->cloth, seed, FAKE_N_FIT);
    x->estimator = fake_estimator(&x->cloth);
    fake_param_set(mid_range, x->truth);
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->truth, 0.005, seed, &x->observation), STATUS_OK);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        x->parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    x->problem = (struct fit_problem){.n_param = FAKE_N_PARAM,
                                      .info = fake_param,
                                      .param = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator,
                                      .path_budget = path_budget,
                                      .report = on_step,
                                      .report_context = x};
}

static void run(struct fixture *x, const struct descent_method *method, struct fit_result *result)
{
    struct error err = {0};
    x->n_reported = 0;
    if (method->run(&x->problem, result, &err) != STATUS_OK) fail_msg("%s: %s", method->info->id, err.text);
    assert_int_equal(result->n_step, x->n_reported);
    assert_true(result->reason[0] != '\0' && result->n_path > 0);
}

/* The estimator of the fixture, counting calls of either kind. */
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

/* The published method is traced as published, ours with all that the renderer has. */
static void test_kind_of_paths(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        struct fixture x;
        struct fit_result r;
        setup(&x, 1, 400000);
        struct counted c = {.inner = x.estimator};
        struct estimator e = {&c, x.estimator.n_configuration, x.estimator.n_param, counted_run};
        x.problem.estimator = &e;
        run(&x, *m, &r);
        bool published = (*m)->info == &method_published_sgd;
        assert_true(c.n_plain + c.n_probing > 0 && (published ? c.n_probing : c.n_plain) == 0);
        observation_set_release(&x.observation);
    }
}

/* The estimator of the fixture, each call of which reports its own progress from 0 to 1; and what a listener hears. */
struct heard {
    struct estimator inner;
    double fraction, after_first;
    size_t n_call;
};

static status telling_run(void *context, const struct estimator_call *call, const struct progress *progress,
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

/* A rendering that is done is not the whole fit that is done. */
static void test_progress(void **state)
{
    (void)state;
    static const uint64_t budget[] = {4000000, 200000}; /* less than published_sgd's least, too */
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        for (size_t i = 0; i < 2; i++) {
            struct fixture x;
            struct fit_result r;
            setup(&x, 1, budget[i]);
            struct heard h = {.inner = x.estimator};
            struct estimator e = {&h, x.estimator.n_configuration, x.estimator.n_param, telling_run};
            struct progress progress = {.report = hear, .context = &h};
            x.problem.estimator = &e;
            x.problem.progress = &progress;
            run(&x, *m, &r);
            print_message("%s: progress %.3f after the first of %zu renderings, %.3f at the end\n", (*m)->info->id,
                          h.after_first, h.n_call, h.fraction);
            assert_true(h.after_first > 0.0 && h.after_first < 4.0 / (double)h.n_call);
            assert_true(h.fraction > 0.9);
            observation_set_release(&x.observation);
        }
    }
}

/* What a method calls its least budget is what it takes when it is given less, and it stays inside when it is given that. */
static void test_least_budget(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        for (int bounded = 0; bounded < 2; bounded++) {
            struct fixture x;
            struct fit_result r;
            setup(&x, 1, 1000);
            if (bounded) x.parameter[1].lower = 1.5 * x.parameter[0].lower; /* a channel with a curve of its own */
            uint64_t least = (*m)->least_budget(&x.problem);
            run(&x, *m, &r);
            print_message("%s: least budget %.0f, takes %.0f of 1000\n", (*m)->info->id, (double)least,
                          (double)r.n_path);
            assert_true(r.n_path <= least && (double)r.n_path > 0.9 * (double)least);
            x.problem.path_budget = least;
            run(&x, *m, &r);
            assert_true(r.n_path <= least);
            observation_set_release(&x.observation);
        }
    }
}

/* A few short runs hold no steps that could be compared: that is not converged, however low the objective. */
static void test_published_sgd_needs_steps(void **state)
{
    (void)state;
    for (size_t n_iteration = 1; n_iteration <= 10; n_iteration += 3) {
        struct fixture x;
        struct fit_result r;
        setup(&x, 1, 400000);
        x.problem.max_iteration = n_iteration;
        run(&x, descent_find(method_published_sgd.id), &r);
        if (r.converged || strstr(r.reason, "too few to tell") == NULL)
            fail_msg("%zu iterations: %s", n_iteration, r.reason);
        observation_set_release(&x.observation);
    }
}

/* Steps that all point the same way have a mean cosine near 1, also in the first run that is long enough. */
static void test_published_sgd_mean_cosine_has_no_start(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    double cosine = 0.0;
    setup(&x, 1, 40000000);
    x.cloth.noise = 1e-3;
    x.problem.max_iteration = 11;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) x.parameter[p].fixed = p != 8; /* one parameter: cosines are 1 or -1 */
    run(&x, descent_find(method_published_sgd.id), &r);
    const char *text = strstr(r.reason, "mean cosine of ");
    assert_non_null(text);
    cosine = strtod(text + strlen("mean cosine of "), NULL);
    print_message("%s\n", r.reason);
    assert_true(fabs(cosine) > 0.99);
    observation_set_release(&x.observation);
}

static void test_every_method_recovers(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        struct fixture x;
        struct fit_result r;
        setup(&x, 1, 400000000);
        run(&x, *m, &r);
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
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        struct fixture x;
        struct fit_result r;
        setup(&x, 2, 3000000);
        x.parameter[6] = (struct fit_parameter){fake_param[6].lower, fake_param[6].upper, x.truth[6], true};
        x.parameter[3].upper = 0.86; /* below the truth: the fit must end at the bound and stay there */
        x.problem.max_iteration = 25;
        run(&x, *m, &r);
        assert_true(r.param[6] == x.truth[6] && r.uncertainty.se_param[6] == 0.0);
        assert_true(r.param[3] <= 0.86 && r.param[3] > 0.8);
        observation_set_release(&x.observation);
    }
}

static void test_every_method_repeats(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        struct fixture x;
        struct fit_result a, b;
        setup(&x, 4, 1500000);
        x.problem.max_iteration = 6;
        run(&x, *m, &a);
        run(&x, *m, &b);
        assert_memory_equal(&a, &b, sizeof a);
        observation_set_release(&x.observation);
    }
}

/* Through a journal, stopped at several places, with and without a torn tail: the end is that of an uninterrupted fit.
 */
static void resume_after(void **state, const struct descent_method *m, size_t n_call, bool tear,
                         const struct fit_result *want)
{
    struct fixture x;
    struct fit_result r;
    struct error err = {0};
    struct estimate_journal *j = NULL;
    const char *path = scratch_path(state, "estimates.journal");
    unlink(path);
    setup(&x, 4, 1500000);
    x.problem.max_iteration = 6;
    x.cloth.fail_after = n_call;
    assert_int_equal(estimate_journal_open(path, 7, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
    struct estimator through = estimate_journal_estimator(j);
    x.problem.estimator = &through;
    assert_int_equal(m->run(&x.problem, &r, &err), STATUS_CANCELLED);
    estimate_journal_close(j);
    if (tear) {
        size_t n;
        char *bytes = scratch_read(path, &n);
        scratch_write(path, bytes, n - 5);
        free(bytes);
    }
    x.cloth.fail_after = 0;
    x.cloth.n_call = 0;
    assert_int_equal(estimate_journal_open(path, 7, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
    through = estimate_journal_estimator(j);
    run(&x, m, &r);
    assert_int_equal(estimate_journal_n_replayed(j), tear ? n_call - 1 : n_call);
    assert_memory_equal(r.param, want->param, sizeof r.param);
    assert_memory_equal(&r.uncertainty, &want->uncertainty, sizeof r.uncertainty);
    assert_true(r.n_path == want->n_path && r.n_step == want->n_step && r.wall_s == want->wall_s);
    estimate_journal_close(j);
    observation_set_release(&x.observation);
}

static void test_resume(void **state)
{
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        struct fixture x;
        struct fit_result want;
        setup(&x, 4, 1500000);
        x.problem.max_iteration = 6;
        run(&x, *m, &want);
        observation_set_release(&x.observation);
        for (size_t n_call = 1; n_call <= 10; n_call += 3) {
            resume_after(state, *m, n_call, false, &want);
            resume_after(state, *m, n_call, true, &want);
        }
    }
}

/* Another fingerprint, or another request, must not be answered from the file. */
static void test_foreign_journal(void **state)
{
    struct fixture x;
    struct estimate_journal *j = NULL;
    struct estimate out[FAKE_N_FIT];
    size_t n_path[FAKE_N_FIT];
    double wall_s, param[FAKE_N_PARAM];
    const char *path = scratch_path(state, "foreign.journal");
    setup(&x, 5, 0);
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 256;
    memcpy(param, x.truth, sizeof param);
    struct estimator_call call = {param, n_path, 3, 0, true};
    for (int k = 0; k < 5; k++) {
        if (k == 3) param[0] *= 1.1;
        assert_int_equal(estimate_journal_open(path, k < 2 ? 1 : 2, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
        struct estimator e = estimate_journal_estimator(j);
        assert_int_equal(e.run(e.context, &call, NULL, out, &wall_s, NULL), STATUS_OK);
        assert_int_equal(estimate_journal_n_replayed(j), k == 1 || k == 4 ? 1 : 0);
        estimate_journal_close(j);
    }
    observation_set_release(&x.observation);
}

static status refuse(void *context, struct error *err)
{
    (void)context;
    return error_set(err, STATUS_STALE, "not any more");
}

static void test_stale_writer(void **state)
{
    struct fixture x;
    struct estimate_journal *j = NULL;
    struct fit_result r;
    setup(&x, 5, 100000);
    assert_int_equal(
        estimate_journal_open(scratch_path(state, "stale.journal"), 1, &x.estimator, refuse, NULL, &j, NULL),
        STATUS_OK);
    struct estimator e = estimate_journal_estimator(j);
    x.problem.estimator = &e;
    assert_int_equal(descent_registry()[0]->run(&x.problem, &r, NULL), STATUS_STALE);
    estimate_journal_close(j);
    observation_set_release(&x.observation);
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
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++) {
        struct fixture x;
        struct fit_result r;
        struct error err = {0};
        setup(&x, 1, 100000);
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
        cmocka_unit_test(test_least_budget),
        cmocka_unit_test(test_published_sgd_needs_steps),
        cmocka_unit_test(test_published_sgd_mean_cosine_has_no_start),
        cmocka_unit_test(test_every_method_recovers),
        cmocka_unit_test(test_fixed_and_bounds),
        cmocka_unit_test(test_every_method_repeats),
        cmocka_unit_test(test_resume),
        cmocka_unit_test(test_foreign_journal),
        cmocka_unit_test(test_stale_writer),
        cmocka_unit_test(test_bounded_quadratic),
        cmocka_unit_test(test_bad_problems),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
