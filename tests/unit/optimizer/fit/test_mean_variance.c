/* mean_variance.v1 on a cloth whose moments are known in closed form: row i of channel c has the radiance
 * alpha_c (1 + k_i / (1 + 10 gamma)) with the mean of k 0, so that its mean is alpha_c and its relative variance falls
 * with gamma. */
#include "base/catalogue/method_catalogue.h"
#include "base/catalogue/model_catalogue.h"
#include "optimizer/fit/descent/descent.h"
#include "optimizer/job/document/job_document.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "tests/support/job_document_text.h"

enum { N_ROW = 8, N_PARAM = 5, GAMMA = 3, DENSITY = 4, N_HALVING = 9 };

static double radiance(const double *param, size_t i, int c)
{
    static const double k[N_ROW] = {3.0, -0.5, -0.5, -0.5, -0.5, -0.5, -0.5, 0.0};
    return param[c] * (1.0 + k[i] / (1.0 + 10.0 * param[GAMMA]));
}

static status run_estimator(void *context, const struct estimator_call *call, const struct progress *progress,
                            struct estimate *out, double *wall_s, struct error *err)
{
    size_t *n_call = context;
    (void)progress;
    (void)err;
    ++*n_call;
    *wall_s = 0.25;
    for (size_t i = 0; i < N_ROW; i++) {
        memset(&out[i], 0, sizeof out[i]);
        out[i].n_path = call->n_path[i];
        for (int c = 0; c < 3; c++) {
            out[i].mean[c] = radiance(call->param, i, c);
            out[i].var[c] = 1e-8;
            for (size_t p = 0; p < N_PARAM && call->want_jacobian; p++) {
                double moved[N_PARAM];
                memcpy(moved, call->param, sizeof moved);
                moved[p] *= 1.0 + 1e-6;
                out[i].jac[3 * p + (size_t)c] = (radiance(moved, i, c) - out[i].mean[c]) / (1e-6 * call->param[p]);
            }
        }
    }
    return STATUS_OK;
}

struct setting {
    struct fit_parameter parameter[N_PARAM];
    struct observation_set observation;
    struct estimator estimator;
    struct fit_problem problem;
    size_t n_call;
};

static void setup(struct setting *x, const double *truth, double light)
{
    const struct model_info *m = model_catalogue_find(method_mean_variance.only_model);
    assert_non_null(m);
    assert_int_equal(m->n_param, N_PARAM);
    *x = (struct setting){0};
    x->estimator = (struct estimator){&x->n_call, N_ROW, N_PARAM, run_estimator};
    observation_set_init(&x->observation);
    for (size_t i = 0; i < N_ROW; i++) {
        struct observation row = {.set = JOB_SET_FIT, .weight = 1.0};
        row.configuration = (struct configuration){.light_theta_rad = 0.5,
                                                   .light_distance_m = 0.6,
                                                   .lamp_side_m = 0.1,
                                                   .camera_distance_m = 1.0,
                                                   .crop_m = 0.01};
        for (int c = 0; c < 3; c++) row.mean_rgb[c] = light * radiance(truth, i, c);
        assert_int_equal(observation_set_append(&x->observation, &row, NULL), STATUS_OK);
    }
    for (size_t p = 0; p < N_PARAM; p++)
        x->parameter[p] = (struct fit_parameter){m->param[p].lower, m->param[p].upper, m->param[p].start, p == DENSITY};
    x->problem = (struct fit_problem){.n_param = N_PARAM,
                                      .info = m->param,
                                      .parameter = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator};
}

static const double truth[N_PARAM] = {0.7, 0.2, 0.05, 0.013, 400000.0};

/* Half of the last interval of each bisection, in its coordinate: logit of the albedo, logarithm of the width. */
static void check_found(const struct setting *x, const double *found, double light)
{
    const struct param_info *info = x->problem.info;
    const double logit_range = 2.0 * log(0.999 / 0.001), log_range = log(info[GAMMA].upper / info[GAMMA].lower);
    for (int c = 0; c < 3; c++) {
        const double want = light * truth[c];
        const double off = log(found[c] / (1.0 - found[c])) - log(want / (1.0 - want));
        if (fabs(off) > logit_range / (1 << N_HALVING)) fail_msg("albedo %d: %.5f, true %.5f", c, found[c], want);
    }
    if (fabs(log(found[GAMMA] / truth[GAMMA])) > log_range / (1 << N_HALVING))
        fail_msg("gamma %.5f, true %.5f", found[GAMMA], truth[GAMMA]);
}

/* The brightness scales the albedo alone. */
static void test_moments_are_met(void **state)
{
    (void)state;
    for (int dark = 0; dark < 2; dark++) {
        struct setting x;
        struct fit_result r;
        struct error err = {0};
        setup(&x, truth, dark ? 0.5 : 1.0);
        if (descent_find(method_mean_variance.id)->run(&x.problem, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
        check_found(&x, r.param, dark ? 0.5 : 1.0);
        assert_true(r.converged && r.stop == STOP_SCHEDULE);
        assert_true(r.param[DENSITY] == x.parameter[DENSITY].start);
        assert_int_equal(x.n_call, 2 * (N_HALVING * N_HALVING + 4));
        observation_set_release(&x.observation);
    }
}

static void test_fixed_width_stays(void **state)
{
    (void)state;
    struct setting x;
    struct fit_result r;
    struct error err = {0};
    setup(&x, truth, 1.0);
    x.parameter[GAMMA].fixed = true;
    if (descent_find(method_mean_variance.id)->run(&x.problem, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(r.param[GAMMA] == x.parameter[GAMMA].start);
    assert_true(fabs(r.param[0] - truth[0]) < 0.01);
    assert_false(r.converged); /* the width that stays gives another variance */
    observation_set_release(&x.observation);
}

/* A row of weight 0 counts in neither moment. */
static void test_weight_zero(void **state)
{
    (void)state;
    struct setting x;
    struct fit_result r;
    struct error err = {0};
    setup(&x, truth, 1.0);
    for (int c = 0; c < 3; c++) x.observation.item[N_ROW - 1].mean_rgb[c] = 9.0;
    x.observation.item[N_ROW - 1].weight = 0.0;
    if (descent_find(method_mean_variance.id)->run(&x.problem, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    check_found(&x, r.param, 1.0);
    observation_set_release(&x.observation);
}

/* A color is missing. */
static void test_other_models_are_refused(void **state)
{
    (void)state;
    struct setting x;
    struct fit_result r;
    struct error err = {0};
    struct param_info info[N_PARAM];
    setup(&x, truth, 1.0);
    memcpy(info, x.problem.info, sizeof info);
    info[0].channel = -1;
    x.problem.info = info;
    assert_int_equal(descent_find(method_mean_variance.id)->run(&x.problem, &r, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, method_mean_variance.only_model));
    observation_set_release(&x.observation);
}

static void test_document_needs_its_model(void **state)
{
    (void)state;
    char text[400];
    snprintf(text, sizeof text, FIT_OF("{\"method\":\"%s\"}"), method_mean_variance.id);
    job_document_check_error(text, "fit.method", method_mean_variance.only_model);
    snprintf(text, sizeof text, FIT_OF("{\"method\":\"%s\",\"model\":\"%s\"}"), method_mean_variance.id,
             method_mean_variance.only_model);
    job_document_free(job_document_of_text(text));
    snprintf(text, sizeof text, FIT_OF("{\"method\":\"%s\",\"model\":\"%s\",\"fit_density\":true}"),
             method_mean_variance.id, method_mean_variance.only_model);
    job_document_check_error(text, "fit.fit_density", "does not know it");
}

/* The least budget grows with the halvings that the job asks for: 256 paths for each of 2 (n^2 + 4) renderings. */
static void test_least_budget(void **state)
{
    (void)state;
    struct setting x;
    setup(&x, truth, 1.0);
    for (size_t n = 0; n <= 20; n += 10) {
        const double halvings = n > 0 ? (double)n : N_HALVING;
        x.problem.max_iteration = n;
        assert_true((double)descent_find(method_mean_variance.id)->least_budget(&x.problem) >=
                    256.0 * N_ROW * 2.0 * (halvings * halvings + 4.0));
    }
    observation_set_release(&x.observation);
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_moments_are_met),
                                      cmocka_unit_test(test_fixed_width_stays),
                                      cmocka_unit_test(test_weight_zero),
                                      cmocka_unit_test(test_other_models_are_refused),
                                      cmocka_unit_test(test_document_needs_its_model),
                                      cmocka_unit_test(test_least_budget)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
