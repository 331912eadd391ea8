/* Fits with as many unknowns as are allowed, and with one more. */
#include "base/catalogue/method_catalogue.h"
#include "base/option_id.h"
#include "base/rng.h"
#include "optimizer/fit/descent/fit_run.h"
#include "renderer/scattering/appearance.h"
#include "tests/support/general_methods.h"
#include "tests/support/tracer/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- as many unknowns as there is room for ---- */

enum { WIDE = FIT_MAX_PARAM, WIDE_ROWS = 40 };

/* Pseudo-random factors, so that every parameter is determined. */
static double wide_factor[WIDE_ROWS][3][WIDE];

static int draw_factors(void **state)
{
    (void)state;
    const struct rng_key key = {.seed = 3};
    for (size_t i = 0; i < WIDE_ROWS; i++)
        for (size_t c = 0; c < 3; c++)
            for (size_t p = 0; p < WIDE; p++) {
                struct rng r;
                double z[2];
                rng_start(&r, &key, (uint32_t)(3 * i + c), (uint32_t)p);
                rng_normal_pair(&r, z);
                wide_factor[i][c][p] = 0.05 * (1.5 + 0.5 * z[0]);
            }
    return 0;
}

static void wide_radiance(size_t n_param, size_t i, const double *param, struct estimate *e)
{
    for (size_t c = 0; c < 3; c++) {
        e->mean[c] = 0.05;
        for (size_t p = 0; p < n_param; p++) {
            e->jac[c * n_param + p] = wide_factor[i][c][p];
            e->jac_var[c * n_param + p] = 1e-8;
            e->mean[c] += param[p] * wide_factor[i][c][p];
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
        out[i].n_path = out[i].n_bounce = call->n_path[i];
    }
    return STATUS_OK;
}

/* Fits n_param parameters of one model together with two nuisance terms and a gain for each of 40 photographs. */
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
                                        .parameter = parameter,
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
    for (const struct descent_method *const *m = general_methods(); *m != NULL; m++)
        if (fit_wide(WIDE, &plain, (*m)->info->id, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (fit_wide(WIDE - 1, &nuisance, method_gauss_newton.id, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(fit_wide(WIDE, &nuisance, method_gauss_newton.id, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_NUISANCE);
}

/* The limit on unknowns allows all nuisance terms with every model of the program, when all its parameters are free. */
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
        struct fit_parameter parameter[FIT_MAX_PARAM];
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
        cmocka_unit_test(test_as_many_unknowns_as_there_is_room_for),
        cmocka_unit_test(test_every_model_has_room_for_nuisance_terms),
    };
    return cmocka_run_group_tests(tests, draw_factors, NULL);
}
