/* Options of a fit that do not depend on the method: ties, bounds, priors, several starts. A fit with any of them
 * resumes with the same bits. */
#include "base/catalogue/method_catalogue.h"
#include "base/option_id.h"
#include "base/rng.h"
#include "optimizer/fit/descent/estimate_journal.h"
#include "optimizer/fit/descent/fit_run.h"
#include "renderer/scattering/appearance.h"
#include "tests/support/fit_fixture.h"
#include "tests/support/general_methods.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* Values and derivatives by the unknowns against central differences of the values. */
static void test_layout_derivatives(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_layout l;
    fit_fixture_init(&x, fit_fixture_mid_range, 1, true, 0.0);
    fit_fixture_tie_colours(&x.option);
    x.option.leader[8] = 7;
    x.option.ratio[8] = 1.5;
    x.option.ratio[1] = 0.8;
    x.option.global_gain_sd = x.option.stray_light_sd = 0.1;
    assert_int_equal(fit_layout_init(&l, fake_param, x.parameter, FAKE_N_PARAM, &x.option, NULL), STATUS_OK);
    assert_int_equal(l.n_unknown, 6);
    assert_true(l.i_gain == 4 && l.i_stray == 5);
    const double at[6] = {0.1, 0.6, 0.08, 0.3, 1.2, 0.02};
    double full[FAKE_N_PARAM], rgb[2][3];
    struct estimate e = {.n_path = 1}, out, shifted[2];
    fit_layout_full(&l, at, full);
    assert_true(full[1] == 0.8 * 0.1 && full[2] == 0.1 && full[8] == 1.5 * 0.3);
    fake_radiance(&x.cloth.configuration[2], full, e.mean, e.jac);
    fit_layout_estimate(&l, at, true, &e, &out);
    for (size_t k = 0; k < 6; k++) {
        double h = 1e-5 * at[k];
        for (int side = 0; side < 2; side++) {
            double moved[6];
            memcpy(moved, at, sizeof moved);
            moved[k] += side == 0 ? h : -h;
            fit_layout_full(&l, moved, full);
            fake_radiance(&x.cloth.configuration[2], full, shifted[side].mean, NULL);
            memset(shifted[side].var, 0, sizeof shifted[side].var);
            fit_layout_estimate(&l, moved, false, &shifted[side], &shifted[side]);
            memcpy(rgb[side], shifted[side].mean, sizeof rgb[side]);
        }
        for (size_t c = 0; c < 3; c++)
            assert_true(fabs(out.jac[c * 6 + k] - (rgb[0][c] - rgb[1][c]) / (2.0 * h)) <
                        1e-5 * (1e-3 + fabs(out.jac[c * 6 + k])));
    }
    fit_fixture_release(&x);
}

/* Without options, fit_run is the method. */
static void test_plain(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result direct, r;
    fit_fixture_init(&x, fit_fixture_mid_range, 3, false, 0.005);
    fit_fixture_run(&x, &r);
    x.n_reported = 0;
    assert_int_equal(descent_find(method_gauss_newton.id)->run(&x.problem, &direct, NULL), STATUS_OK);
    assert_memory_equal(r.param, direct.param, sizeof r.param);
    assert_memory_equal(r.uncertainty.correlation, direct.uncertainty.correlation, sizeof r.uncertainty.correlation);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        assert_true(fabs(r.uncertainty.se_param[p] - direct.uncertainty.se_param[p]) <=
                    1e-12 * direct.uncertainty.se_param[p]);
    fit_fixture_release(&x);
}

static void test_tied(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result r, loose;
    fit_fixture_init(&x, fit_fixture_grey, 5, true, 0.02);
    fit_fixture_run(&x, &loose);
    fit_fixture_tie_colours(&x.option);
    x.option.leader[8] = 7;
    x.option.ratio[8] = 2.0; /* as in the truth: 15 and 30 degrees */
    fit_fixture_run(&x, &r);
    assert_true(r.param[0] == r.param[1] && r.param[3] == r.param[5] && r.param[8] == 2.0 * r.param[7]);
    assert_true(r.uncertainty.correlation[1] == 1.0 && r.uncertainty.correlation[7 * FAKE_N_PARAM + 8] == 1.0);
    assert_true(fabs(r.uncertainty.se_param[8] - 2.0 * r.uncertainty.se_param[7]) < 1e-12);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        assert_true(fabs(r.param[p] - x.truth[p]) < 4.0 * r.uncertainty.se_param[p]);
        /* the covariance of a tied parameter in its own coordinate gives back its standard error */
        struct coordinate k;
        coordinate_init(&k, &fake_param[p], fake_param[p].lower, fake_param[p].upper);
        double se = coordinate_slope(&k, r.param[p]) * sqrt(r.uncertainty.cov[p * FAKE_N_PARAM + p]);
        assert_true(fabs(se - r.uncertainty.se_param[p]) < 1e-6 * se || !r.uncertainty.determined[p]);
    }
    double ratio = 0.0; /* ln of the ratio of the errors: three channels now determine one value */
    for (size_t p = 0; p < 3; p++) ratio += log(r.uncertainty.se_param[p] / loose.uncertainty.se_param[p]) / 3.0;
    print_message("errors of a tied colour: %.2f of those of an untied one\n", exp(ratio));
    assert_true(ratio < -0.1);
    fit_fixture_release(&x);
}

/* Without data the result is the prior. With data their precisions are added. A weak prior changes nothing. */
static void test_priors(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result none, weak, strong, even;
    fit_fixture_init(&x, fit_fixture_mid_range, 7, true, 0.02);
    fit_fixture_run(&x, &none);
    size_t p = 4;
    double se = none.uncertainty.se_param[p];
    x.option.prior_mean[p] = none.param[p];
    x.option.prior_se[p] = 100.0 * se;
    fit_fixture_run(&x, &weak);
    assert_true(fabs(weak.param[p] - none.param[p]) < 0.3 * se);
    assert_true(fabs(weak.uncertainty.se_param[p] / se - 1.0) < 0.1);
    x.option.prior_mean[p] = none.param[p] - 3.0 * se;
    x.option.prior_se[p] = se;
    fit_fixture_run(&x, &even);
    print_message("prior 3 se below, as wide as the data's error: moved by %.2f se (half of 3), error %.2f (0.71)\n",
                  (even.param[p] - none.param[p]) / se, even.uncertainty.se_param[p] / se);
    assert_true(even.param[p] < none.param[p] - 0.9 * se && even.param[p] > none.param[p] - 2.1 * se);
    assert_true(fabs(even.uncertainty.se_param[p] / se - M_SQRT1_2) < 0.12);
    x.option.prior_se[p] = 0.01 * se;
    fit_fixture_run(&x, &strong);
    assert_true(fabs(strong.param[p] - x.option.prior_mean[p]) < 0.03 * se);
    assert_true(fabs(strong.uncertainty.se_param[p] / x.option.prior_se[p] - 1.0) < 0.1);
    assert_true(even.prior_penalty > weak.prior_penalty && isfinite(strong.prior_penalty));
    fit_fixture_release(&x);
}

/* Two channels that are tied in proportion have a prior each. These are two different priors of the leader, although
 * their numbers are equal. When the channels are tied with equal values, they are one prior. */
static void test_priors_of_tied_channels(void **state)
{
    (void)state;
    /* 0.2 +- 0.02 and 0.4 +- 0.04 together, weighted by their precisions in logits */
    const double w[2] = {pow(0.2 * 0.8 / 0.02, 2.0), pow(0.4 * 0.6 / 0.04, 2.0)};
    const double want = 1.0 / (1.0 + exp(-(w[0] * log(0.2 / 0.8) + w[1] * log(0.4 / 0.6)) / (w[0] + w[1])));
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct fit_option o;
    double precision[3];
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    for (int kind = 0; kind < 3; kind++) {
        struct fit_layout l;
        fit_option_init(&o);
        o.prior_mean[0] = 0.2;
        o.prior_se[0] = 0.02;
        if (kind > 0) {
            o.leader[1] = 0;
            o.ratio[1] = kind == 1 ? 1.0 : 0.5;
            o.prior_mean[1] = 0.2;
            o.prior_se[1] = 0.02;
        }
        assert_int_equal(fit_layout_init(&l, fake_param, parameter, FAKE_N_PARAM, &o, NULL), STATUS_OK);
        precision[kind] = l.prior[0].precision;
        double mean = 1.0 / (1.0 + exp(-l.prior[0].mean));
        if (kind < 2)
            assert_true(fabs(mean - 0.2) < 1e-9);
        else
            assert_true(fabs(mean - want) < 1e-6);
    }
    assert_true(precision[1] == precision[0]);
    assert_true(fabs(precision[2] / precision[0] - (w[0] + w[1]) / w[0]) < 1e-6);
}

/* An extra start at the truth is a start beside the fit's own, keeps fixed
 * parameters, and is kept when it ends lower. */
static void test_extra_starts(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result r;
    fit_fixture_init(&x, fit_fixture_mid_range, 9, true, 0.0);
    x.parameter[2].fixed = true;
    x.parameter[2].start = x.truth[2];
    x.option.n_extra_start = 1;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) x.option.extra_start[0][p] = p == 2 ? 2.0 * x.truth[p] : x.truth[p];
    fit_fixture_run(&x, &r);
    assert_int_equal(r.n_start, 2);
    assert_true(r.start[0].from[0] == x.parameter[0].start);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) assert_true(fabs(r.start[1].from[p] / x.truth[p] - 1.0) < 1e-12);
    assert_true(r.start[1].objective <= r.start[0].objective + 1e-9);
    x.option.n_start = FIT_MAX_START;
    assert_int_equal(fit_run(descent_find(method_gauss_newton.id), &x.problem, &x.option, &r, NULL), STATUS_INVALID);
    fit_fixture_release(&x);
}
/* Where the first step of each start was. */
struct first_steps {
    bool seen[FIT_MAX_START];
    double param[FIT_MAX_START][FAKE_N_PARAM];
};

static status note_first(void *context, const struct fit_step *step, struct error *err)
{
    struct first_steps *first = context;
    unsigned k = 0;
    (void)err;
    assert_int_equal(sscanf(step->phase, "start %u of 3", &k), 1);
    assert_true(k >= 1 && k <= 3);
    if (!first->seen[k - 1]) memcpy(first->param[k - 1], step->param, sizeof first->param[k - 1]);
    first->seen[k - 1] = true;
    return STATUS_OK;
}

/* Each start begins where the result says. */
static void test_starts_begin_apart(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result r;
    struct first_steps first = {0};
    fit_fixture_init(&x, fit_fixture_mid_range, 11, false, 0.005);
    x.problem.path_budget = 1000000;
    x.problem.report = note_first;
    x.problem.report_context = &first;
    x.option.n_start = 3;
    assert_int_equal(fit_run(descent_find(method_gauss_newton.id), &x.problem, &x.option, &r, NULL), STATUS_OK);
    for (size_t k = 0; k < 3; k++)
        for (size_t p = 0; p < FAKE_N_PARAM; p++)
            assert_true(first.seen[k] && fabs(first.param[k][p] / r.start[k].from[p] - 1.0) < 1e-9);
    fit_fixture_release(&x);
}

/* Starts lie inside the bounds, differ, and the best is kept; all are listed. */
static void test_starts(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result r;
    fit_fixture_init(&x, fit_fixture_mid_range, 11, false, 0.005);
    x.parameter[7].lower = 0.25;
    x.parameter[7].upper = 0.5;
    x.parameter[7].start = 0.3;
    x.parameter[2].fixed = true;
    x.parameter[2].start = x.truth[2];
    x.problem.path_budget = 3000000;
    x.option.n_start = 3;
    fit_fixture_run(&x, &r);
    assert_int_equal(r.n_start, 3);
    size_t n_kept = 0, kept = 0;
    for (size_t k = 0; k < 3; k++) {
        const struct fit_start *s = &r.start[k];
        assert_true(s->from[7] >= 0.25 && s->from[7] <= 0.5 && s->from[2] == x.truth[2]);
        assert_true(s->n_path > 0 && s->n_path < 1200000 && isfinite(s->objective));
        if (k > 0) assert_true(s->from[0] != r.start[k - 1].from[0] && s->from[6] != r.start[k - 1].from[6]);
        n_kept += s->kept;
        if (s->kept) kept = k;
    }
    assert_int_equal(n_kept, 1);
    assert_memory_equal(r.start[kept].param, r.param, sizeof r.param);
    for (size_t k = 0; k < 3; k++)
        assert_true(r.start[kept].objective <=
                    r.start[k].objective + 2.0 * hypot(r.start[kept].objective_se, r.start[k].objective_se));
    assert_true(fake_rel_rms(&x.cloth, 0, FAKE_N_FIT, r.param, x.truth) < 0.05);
    x.option.n_start = 0;
    struct error err = {0};
    assert_int_equal(fit_run(descent_registry()[0], &x.problem, &x.option, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_STARTS);
    fit_fixture_release(&x);
}

/* Makes replica B with A, as the tracer does where several processes share its work, and counts the estimates. */
struct pairing {
    struct estimator inner;
    size_t n_made, n_asked;
};

static status run_pairing(void *context, const struct estimator_call *call, const struct progress *progress,
                          struct estimate *out, double *wall_s, struct error *err)
{
    struct pairing *p = context;
    struct estimator_pair *pair = call->pair;
    p->n_asked++;
    if (pair != NULL && pair->ready && pair->next == out && pair->iteration == call->iteration &&
        pair->replica == call->replica)
        return STATUS_OK;
    p->n_made++;
    status s = p->inner.run(p->inner.context, call, progress, out, wall_s, err);
    if (s != STATUS_OK || pair == NULL || call->replica != REPLICA_FIT_A) return s;
    struct estimator_call next = *call;
    next.replica = REPLICA_FIT_B;
    p->n_made++;
    *pair = (struct estimator_pair){pair->next, true, next.iteration, next.replica};
    return p->inner.run(p->inner.context, &next, progress, pair->next, wall_s, err);
}

/* No replica is made twice in any start, and the result is that of single ones. */
static void test_replicas_made_together(void **state)
{
    (void)state;
    struct fit_fixture x;
    struct fit_result want, got;
    fit_fixture_init(&x, fit_fixture_mid_range, 17, false, 0.005);
    x.problem.max_iteration = 4;
    x.option.n_start = 2;
    fit_fixture_run(&x, &want);
    struct pairing p = {.inner = x.estimator};
    x.estimator.context = &p;
    x.estimator.run = run_pairing;
    x.n_reported = 0;
    fit_fixture_run(&x, &got);
    assert_true(p.n_asked > 0);
    assert_int_equal(p.n_made, p.n_asked);
    assert_memory_equal(got.param, want.param, sizeof got.param);
    fit_fixture_release(&x);
}

/* A fit with all options that is stopped again and again has the same result as an uninterrupted fit. */
static void test_resume(void **state)
{
    struct fit_fixture x;
    struct fit_result want, got;
    const char *path = scratch_path(state, "options.journal");
    fit_fixture_init(&x, fit_fixture_grey, 13, false, 0.005);
    fit_fixture_tie_colours(&x.option);
    x.option.global_gain_sd = 0.05;
    x.option.stray_light_sd = 0.01;
    x.option.photograph_gain_sd = 0.02;
    x.option.prior_mean[6] = x.truth[6];
    x.option.prior_se[6] = 0.02;
    x.option.n_start = 2;
    x.problem.max_iteration = 4;
    fit_fixture_run(&x, &want);
    size_t n_call = x.cloth.n_call;
    assert_int_equal(n_call, 16);
    for (size_t cut = 1; cut < n_call; cut++) {
        struct estimate_journal *j = NULL;
        unlink(path);
        for (int round = 0; round < 2; round++) {
            x.cloth.n_call = x.n_reported = 0;
            x.cloth.fail_after = round == 0 ? cut : 0;
            assert_int_equal(estimate_journal_open(path, 7, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
            struct estimator through = estimate_journal_estimator(j);
            x.problem.estimator = &through;
            status s = fit_run(descent_find(method_gauss_newton.id), &x.problem, &x.option, &got, NULL);
            assert_int_equal(s, round == 0 ? STATUS_CANCELLED : STATUS_OK);
            if (round == 1) assert_int_equal(estimate_journal_n_replayed(j), cut);
            estimate_journal_close(j);
        }
        assert_memory_equal(&got, &want, sizeof got);
    }
    fit_fixture_release(&x);
}

/* A prior changes the result of a method that takes priors, and no number of any other method. */
static void test_methods_take_priors_as_they_declare(void **state)
{
    (void)state;
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++) {
        struct fit_fixture x;
        struct fit_result with, without;
        fit_fixture_init(&x, fit_fixture_mid_range, 1, false, 0.01);
        x.problem.max_iteration = 3;
        assert_int_equal(fit_run(*m, &x.problem, &x.option, &without, NULL), STATUS_OK);
        x.n_reported = 0;
        x.option.prior_mean[6] = fake_param[6].lower;
        x.option.prior_se[6] = 0.01 * fake_param[6].lower;
        assert_int_equal(fit_run(*m, &x.problem, &x.option, &with, NULL), STATUS_OK);
        if (((*m)->info->takes & METHOD_TAKES_PRIORS) != 0)
            assert_true(with.prior_penalty > 0.0 && with.param[6] < without.param[6]);
        else
            assert_true(with.prior_penalty == 0.0 && with.param[6] == without.param[6]);
        fit_fixture_release(&x);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_methods_take_priors_as_they_declare),
        cmocka_unit_test(test_layout_derivatives),
        cmocka_unit_test(test_plain),
        cmocka_unit_test(test_tied),
        cmocka_unit_test(test_priors),
        cmocka_unit_test(test_priors_of_tied_channels),
        cmocka_unit_test(test_starts),
        cmocka_unit_test(test_starts_begin_apart),
        cmocka_unit_test(test_extra_starts),
        cmocka_unit_test(test_replicas_made_together),
        cmocka_unit_test(test_resume),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
