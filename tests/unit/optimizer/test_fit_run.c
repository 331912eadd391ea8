/* What a job may ask of a fit beyond the method: ties, bounds, priors, nuisance terms, several starts; and that a fit
 * with any of them resumes bit by bit. */
#include "base/catalogue/method_catalogue.h"
#include "base/option_id.h"
#include "base/rng.h"
#include "optimizer/fit/descent/estimate_journal.h"
#include "optimizer/fit/descent/fit_run.h"
#include "renderer/scattering/appearance.h"
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

/* File units; grey, so that the channels of a colour may be tied. */
static const double grey[FAKE_N_PARAM] = {0.1, 0.1, 0.1, 0.7, 0.7, 0.7, 5.0, 15.0, 30.0};
static const double mid_range[FAKE_N_PARAM] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5.0, 15.0, 20.0};

struct fixture {
    struct fake_cloth cloth;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct fit_problem problem;
    struct fit_option option;
    double truth[FAKE_N_PARAM];
    size_t n_reported;
    double last_gain;
};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct fixture *x = context;
    (void)err;
    assert_int_equal(step->step, x->n_reported++);
    assert_int_equal(step->n_param, FAKE_N_PARAM);
    assert_true(step->step_length >= 0.0 && step->step_length <= 1.0 + 1e-9 && step->step_limit <= 1.0);
    assert_true(isfinite(step->damping) && isfinite(step->noise) && isfinite(step->gain));
    for (size_t p = 0; p < step->n_param; p++)
        assert_true(step->param[p] >= fake_param[p].lower && step->param[p] <= fake_param[p].upper);
    if (step->nuisance != NULL) x->last_gain = step->nuisance->value[0];
    return STATUS_OK;
}

/* exact: no Monte-Carlo noise. rel_noise: of the photographs. */
static void setup(struct fixture *x, const double *file_unit, uint64_t seed, bool exact, double rel_noise)
{
    memset(x, 0, sizeof *x);
    fake_cloth_init(&x->cloth, seed, FAKE_N_FIT);
    x->cloth.noise = exact ? 0.0 : 1.0;
    x->estimator = fake_estimator(&x->cloth);
    fake_param_set(file_unit, x->truth);
    fit_option_init(&x->option);
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->truth, rel_noise, seed, &x->observation), STATUS_OK);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        x->parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    x->problem = (struct fit_problem){.n_param = FAKE_N_PARAM,
                                      .info = fake_param,
                                      .param = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator,
                                      .path_budget = 2000000,
                                      .report = on_step,
                                      .report_context = x};
}

static void release(struct fixture *x) { observation_set_release(&x->observation); }

static void fit(struct fixture *x, struct fit_result *r)
{
    struct error err = {0};
    x->n_reported = 0;
    if (fit_run(descent_find(method_gauss_newton.id), &x->problem, &x->option, r, &err) != STATUS_OK)
        fail_msg("%s: %s", err.field, err.text);
    assert_int_equal(r->n_step, x->n_reported);
}

static void tie_colours(struct fit_option *o)
{
    for (size_t p = 0; p < 6; p++) o->leader[p] = 3 * (p / 3);
}

/* Values and derivatives by the unknowns against central differences of the values. */
static void test_layout_derivatives(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_layout l;
    setup(&x, mid_range, 1, true, 0.0);
    tie_colours(&x.option);
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
    release(&x);
}

/* Without options, fit_run is the method. */
static void test_plain(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result direct, r;
    setup(&x, mid_range, 3, false, 0.005);
    fit(&x, &r);
    x.n_reported = 0;
    assert_int_equal(descent_find(method_gauss_newton.id)->run(&x.problem, &direct, NULL), STATUS_OK);
    assert_memory_equal(r.param, direct.param, sizeof r.param);
    assert_memory_equal(r.uncertainty.correlation, direct.uncertainty.correlation, sizeof r.uncertainty.correlation);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        assert_true(fabs(r.uncertainty.se_param[p] - direct.uncertainty.se_param[p]) <=
                    1e-12 * direct.uncertainty.se_param[p]);
    release(&x);
}

static void test_tied(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r, loose;
    setup(&x, grey, 5, true, 0.02);
    fit(&x, &loose);
    tie_colours(&x.option);
    x.option.leader[8] = 7;
    x.option.ratio[8] = 2.0; /* as in the truth: 15 and 30 degrees */
    fit(&x, &r);
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
    double ratio = 0.0; /* ln of the errors' ratio: three channels now speak for one colour */
    for (size_t p = 0; p < 3; p++) ratio += log(r.uncertainty.se_param[p] / loose.uncertainty.se_param[p]) / 3.0;
    print_message("errors of a tied colour: %.2f of those of an untied one\n", exp(ratio));
    assert_true(ratio < -0.1);
    release(&x);
}

/* A prior without data is the prior; with data it is the sum of two precisions; a weak one changes nothing. */
static void test_priors(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result none, weak, strong, even;
    setup(&x, mid_range, 7, true, 0.02);
    fit(&x, &none);
    size_t p = 4;
    double se = none.uncertainty.se_param[p];
    x.option.prior_mean[p] = none.param[p];
    x.option.prior_se[p] = 100.0 * se;
    fit(&x, &weak);
    assert_true(fabs(weak.param[p] - none.param[p]) < 0.3 * se);
    assert_true(fabs(weak.uncertainty.se_param[p] / se - 1.0) < 0.1);
    x.option.prior_mean[p] = none.param[p] - 3.0 * se;
    x.option.prior_se[p] = se;
    fit(&x, &even);
    print_message("prior 3 se below, as wide as the data's error: moved by %.2f se (half of 3), error %.2f (0.71)\n",
                  (even.param[p] - none.param[p]) / se, even.uncertainty.se_param[p] / se);
    assert_true(even.param[p] < none.param[p] - 0.9 * se && even.param[p] > none.param[p] - 2.1 * se);
    assert_true(fabs(even.uncertainty.se_param[p] / se - M_SQRT1_2) < 0.12);
    x.option.prior_se[p] = 0.01 * se;
    fit(&x, &strong);
    assert_true(fabs(strong.param[p] - x.option.prior_mean[p]) < 0.03 * se);
    assert_true(fabs(strong.uncertainty.se_param[p] / x.option.prior_se[p] - 1.0) < 0.1);
    assert_true(even.prior_penalty > weak.prior_penalty && isfinite(strong.prior_penalty));
    release(&x);
}

/* Photographs that are all too bright by one factor, behind glare. */
static void test_global_gain_and_stray_light(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    const double gain = 1.06, stray = 0.01;
    setup(&x, mid_range, 9, true, 0.005);
    for (size_t i = 0; i < x.observation.n; i++)
        for (int c = 0; c < 3; c++)
            x.observation.item[i].mean_rgb[c] = gain * x.observation.item[i].mean_rgb[c] + stray;
    x.option.global_gain_sd = 0.1;
    x.option.stray_light_sd = 0.02;
    fit(&x, &r);
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
    release(&x);
}

/* Exposure errors of 8 % from photograph to photograph: a fit that knows of them is closer, and says so honestly. */
static void test_gain_of_each_photograph(void **state)
{
    (void)state;
    enum { N_SEED = 12 };
    double error[2] = {0.0, 0.0};
    size_t n_inside = 0, n_judged = 0;
    for (uint64_t seed = 1; seed <= N_SEED; seed++) {
        for (int marginal = 0; marginal < 2; marginal++) {
            struct fixture x;
            struct fit_result r;
            setup(&x, mid_range, seed, false, 0.005);
            struct rng_key key = {.seed = 100 + seed};
            struct rng rng;
            rng_start(&rng, &key, 0, 0);
            for (size_t i = 0; i < x.observation.n; i++) {
                double z[2];
                rng_normal_pair(&rng, z);
                for (int c = 0; c < 3; c++) x.observation.item[i].mean_rgb[c] *= exp(0.08 * z[0]);
            }
            if (marginal == 1) x.option.photograph_gain_sd = 0.08;
            fit(&x, &r);
            error[marginal] += pow(fake_rel_rms(&x.cloth, 0, FAKE_N_FIT, r.param, x.truth), 2.0) / N_SEED;
            for (size_t p = 0; p < FAKE_N_PARAM && marginal == 1; p++) {
                if (!r.uncertainty.determined[p] || r.uncertainty.at_bound[p]) continue;
                n_judged++;
                n_inside += fabs(r.param[p] - x.truth[p]) < 2.0 * r.uncertainty.se_param[p];
            }
            release(&x);
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
    nuisance_photograph_gain(&o, &e, &e, 1e-3, 1.0, &gain, &se); /* nothing is known beyond the prior */
    assert_true(fabs(gain - 1.0) < 1e-4 && fabs(se / 1e-3 - 1.0) < 1e-3);
}

/* Noise that the channels share, a gain that the prior hardly holds: by the gain of both replicas together the product of the
 * residuals would be too small by the variance of their mean; each by its own, it is right. */
static void test_own_gains_leave_no_bias(void **state)
{
    (void)state;
    enum { ROUND = 20000 };
    const double noise = 0.02, mean[3] = {0.3, 0.4, 0.5},
                 off[3] = {0.01, 0.0, -0.01}; /* what no gain mends, relative */
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

/* Two channels tied in proportion, each with a prior of its own: two statements about the leader, although their numbers are the
 * same; tied as equals they are one. */
static void test_priors_of_tied_channels(void **state)
{
    (void)state;
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
            assert_true(mean > 0.21 && mean < 0.35); /* 0.2 +- 0.02 and 0.4 +- 0.04 together */
    }
    assert_true(precision[1] == precision[0] && precision[2] > 1.1 * precision[0]);
}

/* Starts lie inside the bounds, differ, and the best is kept; all are listed. */
static void test_starts(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    setup(&x, mid_range, 11, false, 0.005);
    x.parameter[7].lower = 0.25;
    x.parameter[7].upper = 0.5;
    x.parameter[7].start = 0.3;
    x.parameter[2].fixed = true;
    x.parameter[2].start = x.truth[2];
    x.problem.path_budget = 3000000;
    x.option.n_start = 3;
    fit(&x, &r);
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
    release(&x);
}

/* Cut after every few estimates, with all options on: the end is that of an uninterrupted fit. */
static void test_resume(void **state)
{
    struct fixture x;
    struct fit_result want, got;
    const char *path = scratch_path(state, "options.journal");
    setup(&x, grey, 13, false, 0.005);
    tie_colours(&x.option);
    x.option.global_gain_sd = 0.05;
    x.option.stray_light_sd = 0.01;
    x.option.photograph_gain_sd = 0.02;
    x.option.prior_mean[6] = x.truth[6];
    x.option.prior_se[6] = 0.02;
    x.option.n_start = 2;
    x.problem.max_iteration = 4;
    fit(&x, &want);
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
    release(&x);
}

static void test_too_many_unknowns(void **state)
{
    (void)state;
    struct fit_option o;
    struct fit_layout l;
    struct error err = {0};
    struct param_info info[SCATTERING_MAX_PARAM];
    struct fit_parameter p[SCATTERING_MAX_PARAM];
    fit_option_init(&o);
    for (size_t i = 0; i < SCATTERING_MAX_PARAM; i++) {
        info[i] = fake_param[0];
        p[i] = (struct fit_parameter){0.1, 0.9, 0.5, false};
    }
    assert_int_equal(fit_layout_init(&l, info, p, SCATTERING_MAX_PARAM, &o, &err), STATUS_OK);
    o.global_gain_sd = 0.1;
    assert_int_equal(fit_layout_init(&l, info, p, SCATTERING_MAX_PARAM, &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_NUISANCE);
}

/* ---- as many unknowns as there is room for ---- */

enum { WIDE = SCATTERING_MAX_PARAM, WIDE_ROWS = 40 };

/* As if by chance, so that every parameter is determined. */
static double wide_factor(size_t i, size_t c, size_t p)
{
    struct rng_key key = {.seed = 3};
    struct rng r;
    double z[2];
    rng_start(&r, &key, (uint32_t)(3 * i + c), (uint32_t)p);
    rng_normal_pair(&r, z);
    return 0.05 * (1.5 + 0.5 * z[0]);
}

static void wide_radiance(size_t n_param, size_t i, const double *param, struct estimate *e)
{
    for (size_t c = 0; c < 3; c++) {
        e->mean[c] = 0.05;
        for (size_t p = 0; p < n_param; p++) {
            e->jac[c * n_param + p] = wide_factor(i, c, p);
            e->jac_var[c * n_param + p] = 1e-8;
            e->mean[c] += param[p] * wide_factor(i, c, p);
        }
        e->var[c] = 1e-10;
    }
}

static status wide_run(void *context, const struct estimator_call *call, const struct progress *progress,
                       struct estimate *out, double *wall_s, struct error *err)
{
    (void)progress, (void)err;
    const struct estimator *e = context;
    *wall_s = 0.0;
    memset(out, 0, e->n_configuration * sizeof *out);
    for (size_t i = 0; i < e->n_configuration; i++) {
        wide_radiance(e->n_param, i, call->param, &out[i]);
        out[i].n_path = out[i].n_vertex = call->n_path[i];
    }
    return STATUS_OK;
}

/* n_param parameters of one model beside two nuisance terms and a gain for each of 40 photographs. */
static status fit_wide(size_t n_param, const struct fit_option *o, const char *method, struct fit_result *r,
                       struct error *err)
{
    static char name[WIDE][8];
    struct param_info info[WIDE];
    struct fit_parameter parameter[WIDE];
    double truth[WIDE];
    struct observation_set observation;
    struct estimator e = {.n_configuration = WIDE_ROWS, .n_param = n_param, .run = wide_run};
    e.context = &e;
    observation_set_init(&observation);
    for (size_t p = 0; p < n_param; p++) {
        snprintf(name[p], sizeof name[p], "p%zu", p);
        info[p] = (struct param_info){.name = name[p],
                                      .symbol = name[p],
                                      .channel = -1,
                                      .lower = 0.001,
                                      .upper = 0.999,
                                      .start = 0.5,
                                      .coordinate = PARAM_LOGIT};
        parameter[p] = (struct fit_parameter){0.001, 0.999, 0.5, false};
        truth[p] = 0.3 + 0.4 * (double)p / WIDE;
    }
    for (size_t i = 0; i < WIDE_ROWS; i++) {
        struct estimate shown;
        struct observation item = {.weight = 1.0};
        wide_radiance(n_param, i, truth, &shown);
        memcpy(item.mean_rgb, shown.mean, sizeof item.mean_rgb);
        assert_int_equal(observation_set_append(&observation, &item, NULL), STATUS_OK);
    }
    const struct fit_problem problem = {.n_param = n_param,
                                        .info = info,
                                        .param = parameter,
                                        .observation = &observation,
                                        .estimator = &e,
                                        .path_budget = 3000000,
                                        .max_iteration = 25};
    status s = fit_run(descent_find(method), &problem, o, r, err);
    for (size_t p = 0; s == STATUS_OK && p < n_param && strcmp(method, method_gauss_newton.id) == 0; p++)
        if (!(fabs(r->param[p] - truth[p]) < 0.02))
            fail_msg("%zu parameters: p%zu is %g, not %g", n_param, p, r->param[p], truth[p]);
    observation_set_release(&observation);
    return s;
}

static void test_as_many_unknowns_as_there_is_room_for(void **state)
{
    (void)state;
    struct fit_option plain, nuisance;
    struct fit_result r;
    struct error err = {0};
    fit_option_init(&plain);
    fit_option_init(&nuisance);
    nuisance.stray_light_sd = 0.01;
    nuisance.photograph_gain_sd = 0.001;
    nuisance.n_start = 2;
    for (const struct descent_method *const *m = descent_registry(); *m != NULL; m++)
        if (fit_wide(WIDE, &plain, (*m)->info->id, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (fit_wide(WIDE - 1, &nuisance, method_gauss_newton.id, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(fit_wide(WIDE, &nuisance, method_gauss_newton.id, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_NUISANCE);
}

/* Every model of the program has room for all nuisance terms, with every parameter free. */
static void test_every_model_has_room_for_nuisance_terms(void **state)
{
    (void)state;
    struct appearance a;
    struct fit_option o;
    fit_option_init(&o);
    o.global_gain_sd = 0.05;
    o.stray_light_sd = 0.01;
    size_t i = 0;
    for (; appearance_at(i, &a); i++) {
        struct fit_parameter parameter[SCATTERING_MAX_PARAM];
        struct fit_layout l;
        struct error err = {0};
        for (size_t p = 0; p < a.n_param; p++)
            parameter[p] = (struct fit_parameter){a.param[p].lower, a.param[p].upper, a.param[p].start, false};
        if (fit_layout_init(&l, a.param, parameter, a.n_param, &o, &err) != STATUS_OK)
            fail_msg("%s: %s", a.id, err.text);
        assert_int_equal(l.n_unknown, a.n_param + FIT_MAX_NUISANCE);
    }
    assert_true(i >= 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layout_derivatives),
        cmocka_unit_test(test_plain),
        cmocka_unit_test(test_tied),
        cmocka_unit_test(test_priors),
        cmocka_unit_test(test_global_gain_and_stray_light),
        cmocka_unit_test(test_gain_of_each_photograph),
        cmocka_unit_test(test_photograph_gain_estimate),
        cmocka_unit_test(test_own_gains_leave_no_bias),
        cmocka_unit_test(test_priors_of_tied_channels),
        cmocka_unit_test(test_starts),
        cmocka_unit_test(test_resume),
        cmocka_unit_test(test_too_many_unknowns),
        cmocka_unit_test(test_as_many_unknowns_as_there_is_room_for),
        cmocka_unit_test(test_every_model_has_room_for_nuisance_terms),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
