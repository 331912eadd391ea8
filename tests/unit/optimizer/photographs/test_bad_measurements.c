/* Measurements that no one should have: too few, contradictory, dark, all zero; and an estimator that fails. A fit
 * ends, says what it does not know, and never gives a number that is not finite. */
#include "base/angle.h"
#include "base/catalogue/method_catalogue.h"
#include "base/option_id.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/photographs/rows/observation_check.h"
#include "tests/support/general_methods.h"
#include "tests/support/tracer/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N = FAKE_N_PARAM };

static const double mid_range[N] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5.0, 15.0, 20.0};

struct fixture {
    struct fake_cloth cloth;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[N];
    struct fit_problem problem;
    double truth[N];
};

static void setup(struct fixture *x, size_t n_row)
{
    memset(x, 0, sizeof *x);
    fake_cloth_init(&x->cloth, 7, n_row);
    x->estimator = fake_estimator(&x->cloth);
    fake_param_set(mid_range, x->truth);
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->truth, 0.005, 7, &x->observation), STATUS_OK);
    for (size_t p = 0; p < N; p++)
        x->parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    x->problem = (struct fit_problem){.n_param = N,
                                      .info = fake_param,
                                      .parameter = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator,
                                      .path_budget = 2000000,
                                      .max_iteration = 40};
}

static void fit(struct fixture *x, const struct descent_method *method, struct fit_result *r)
{
    struct error err = {0};
    x->problem.max_iteration = method->info == &method_published_sgd ? 6 : 40;
    if (fit_run(method, &x->problem, NULL, r, &err) != STATUS_OK) fail_msg("%s: %s", method->info->id, err.text);
    assert_true(r->reason[0] != '\0' && isfinite(r->objective.value) && isfinite(r->objective.se));
    for (size_t p = 0; p < N; p++) {
        assert_true(r->param[p] >= fake_param[p].lower && r->param[p] <= fake_param[p].upper);
        assert_true(isfinite(r->uncertainty.se_param[p]) && r->uncertainty.se_param[p] >= 0.0);
        for (size_t q = 0; q < N; q++) assert_true(isfinite(r->uncertainty.correlation[p * N + q]));
    }
}

/* Three, and then six measured numbers for nine parameters. */
static void test_fewer_numbers_than_parameters(void **state)
{
    (void)state;
    for (size_t n_row = 1; n_row <= 2; n_row++) {
        for (const struct descent_method *const *method = general_methods(); *method != NULL; method++) {
            struct fixture x;
            struct fit_result r;
            size_t n_undetermined = 0;
            setup(&x, n_row);
            fit(&x, *method, &r);
            for (size_t p = 0; p < N; p++) n_undetermined += !r.uncertainty.determined[p];
            print_message("%s, %zu numbers: %zu parameters undetermined, relative RMS error %.3f\n",
                          (*method)->info->id, 3 * n_row, n_undetermined,
                          fake_rel_rms(&x.cloth, 0, n_row, r.param, x.truth));
            assert_true(n_undetermined >= 2);
            if ((*method)->info == &method_gauss_newton)
                assert_true(fake_rel_rms(&x.cloth, 0, n_row, r.param, x.truth) < 0.1);
            observation_set_release(&x.observation);
        }
    }
}

static void test_contradictory(void **state)
{
    (void)state;
    for (const struct descent_method *const *method = general_methods(); *method != NULL; method++) {
        struct fixture x;
        struct fit_result r;
        setup(&x, FAKE_N_FIT);
        for (size_t i = 0; i < 8; i++) { /* the second eight become the first, half and double as bright */
            x.cloth.configuration[8 + i] = x.cloth.configuration[i];
            x.observation.item[8 + i].configuration = x.observation.item[i].configuration;
            for (int c = 0; c < 3; c++) {
                x.observation.item[8 + i].mean_rgb[c] = 1.5 * x.observation.item[i].mean_rgb[c];
                x.observation.item[i].mean_rgb[c] *= 0.75;
            }
        }
        fit(&x, *method, &r);
        assert_true(r.uncertainty.misfit_var > 0.02); /* a third of each mean: about 0.1 */
        /* 0.004 where the rows agree (gauss_newton.v1) */
        for (size_t p = 3; p < 6; p++) assert_true(r.uncertainty.se_param[p] > 0.025);
        observation_set_release(&x.observation);
    }
}

static void test_all_zero(void **state)
{
    (void)state;
    for (const struct descent_method *const *method = general_methods(); *method != NULL; method++) {
        struct fixture x;
        struct fit_result r;
        setup(&x, FAKE_N_FIT);
        for (size_t i = 0; i < x.observation.n; i++)
            for (int c = 0; c < 3; c++) x.observation.item[i].mean_rgb[c] = 0.0;
        fit(&x, *method, &r);
        if ((*method)->info == &method_gauss_newton)
            for (size_t p = 3; p < 6; p++) assert_true(r.param[p] < 0.05); /* black */
        observation_set_release(&x.observation);
    }
}

/* One row is a thousand times darker than it should be. The other rows still determine the result. */
static void test_one_dark_row(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    setup(&x, FAKE_N_FIT);
    for (int c = 0; c < 3; c++) x.observation.item[4].mean_rgb[c] *= 1e-3;
    x.observation.item[4].weight = 0.0; /* what a user can do about it */
    fit(&x, descent_find(method_gauss_newton.id), &r);
    assert_true(fake_rel_rms(&x.cloth, 0, FAKE_N_FIT, r.param, x.truth) < 0.1);
    observation_set_release(&x.observation);
}

/* When all weights are 0, no parameter is determined. */
static void test_no_row_has_weight(void **state)
{
    (void)state;
    for (const struct descent_method *const *method = general_methods(); *method != NULL; method++) {
        struct fixture x;
        struct fit_result r;
        setup(&x, FAKE_N_FIT);
        for (size_t i = 0; i < x.observation.n; i++) x.observation.item[i].weight = 0.0;
        fit(&x, *method, &r);
        for (size_t p = 0; p < N; p++) {
            if (r.uncertainty.determined[p])
                fail_msg("%s: %s counts as determined", (*method)->info->id, fake_param[p].name);
            assert_true(fabs(r.param[p] - x.parameter[p].start) < 1e-9);
        }
        observation_set_release(&x.observation);
    }
}

static status fail_numeric(void *context, const struct estimator_call *call, const struct progress *progress,
                           struct estimate *out, double *wall_s, struct error *err)
{
    (void)context, (void)call, (void)progress, (void)out, (void)wall_s;
    return error_set_field(err, STATUS_NUMERIC, "beta_R", "scattering model 'x.v1' gave a value that is not finite");
}

static void test_failing_model(void **state)
{
    (void)state;
    for (const struct descent_method *const *method = general_methods(); *method != NULL; method++) {
        struct fixture x;
        struct fit_result r;
        struct error err = {0};
        setup(&x, FAKE_N_FIT);
        x.estimator.run = fail_numeric;
        assert_int_equal(fit_run(*method, &x.problem, NULL, &r, &err), STATUS_NUMERIC);
        assert_string_equal(err.field, "beta_R");
        assert_non_null(strstr(err.text, "x.v1"));
        observation_set_release(&x.observation);
    }
}

/* ---- warnings ---- */

struct said {
    size_t n;
    char text[8][500];
};

static void listen(void *context, const char *option, const char *text)
{
    struct said *s = context;
    assert_string_equal(option, OPTION_NONE);
    assert_true(s->n < 8);
    snprintf(s->text[s->n++], sizeof s->text[0], "%s", text);
}

static void test_warnings(void **state)
{
    (void)state;
    struct fixture x;
    struct said s = {0};
    setup(&x, FAKE_N_FIT);
    struct observation *o = x.observation.item;
    o[7].configuration.camera_theta_rad = o[15].configuration.camera_theta_rad = 0.1; /* phi counts for the fake at 0 */
    observation_set_check(&x.observation, &(struct warning_sink){listen, &s});
    assert_int_equal(s.n, 0);
    for (int c = 0; c < 3; c++) {
        o[3].mean_rgb[c] = 0.0;
        o[4].mean_rgb[c] *= 1e-5;
    }
    o[6] = o[5]; /* the same within noise: fine */
    o[6].mean_rgb[1] *= 1.3;
    o[6].se_rgb[1] = o[6].mean_rgb[1];
    o[8] = o[7];
    o[8].mean_rgb[2] *= 1.3;
    snprintf(o[8].name, sizeof o[8].name, "again");
    observation_set_check(&x.observation, &(struct warning_sink){listen, &s});
    assert_int_equal(s.n, 3);
    assert_non_null(strstr(s.text[0], "'row-3' is zero"));
    assert_non_null(strstr(s.text[1], "'row-4' is dark"));
    assert_non_null(strstr(s.text[2], "'row-7' and 'again'"));
    for (size_t i = 0; i < x.observation.n; i++)
        for (int c = 0; c < 3; c++) o[i].mean_rgb[c] = 0.0;
    s.n = 0;
    observation_set_check(&x.observation, &(struct warning_sink){listen, &s});
    assert_int_equal(s.n, 4);
    assert_non_null(strstr(s.text[3], "13 more rows"));
    observation_set_release(&x.observation);
}

/* Collects the warnings for five rows, three lit from the front by these lamps and two from behind. */
static void check_rows(const double light_theta_deg[3], const double value[5], const double weight[5], struct said *s)
{
    struct observation item[5];
    const struct observation_set o = {.n = 5, .capacity = 5, .item = item};
    for (size_t i = 0; i < 5; i++) {
        double theta_deg = i < 3 ? light_theta_deg[i] : 150.0;
        item[i] = (struct observation){.configuration = {.light_theta_rad = theta_deg * RAD_PER_DEG,
                                                         .camera_theta_rad = 0.1 * (double)i,
                                                         .light_distance_m = 0.61,
                                                         .lamp_side_m = 0.1},
                                       .mean_rgb = {value[i], value[i], value[i]},
                                       .weight = weight[i]};
        snprintf(item[i].name, sizeof item[i].name, "row-%zu", i);
    }
    s->n = 0;
    observation_set_check(&o, &(struct warning_sink){listen, s});
}

static void test_too_dark_and_too_bright(void **state)
{
    (void)state;
    static const double usual[3] = {20, 30, 60}, grazing[3] = {20, 30, 88}, one[5] = {1, 1, 1, 1, 1};
    struct said s;
    check_rows(usual, (const double[5]){0.1, 0.12, 0.09, 0.01, 0.002}, one, &s);
    assert_int_equal(s.n, 0);
    check_rows(usual, (const double[5]){0.1, 0.0006, 0.09, 0.01, 0.01}, one, &s); /* 0.6 % as bright */
    assert_int_equal(s.n, 1);
    assert_non_null(strstr(s.text[0], "'row-1' is dark: its brightness 0.0006 is 0.65 %"));
    check_rows(usual, (const double[5]){0.1, 0.0006, 0.09, 0.01, 0.01}, (const double[5]){1, 0, 1, 1, 1}, &s);
    assert_int_equal(s.n, 0);                                                     /* the density is not fitted */
    check_rows(grazing, (const double[5]){0.1, 0.1, 0.003, 0.01, 0.01}, one, &s); /* little light falls on the cloth */
    assert_int_equal(s.n, 0);
    check_rows(usual, (const double[5]){0.1, 0.1, 0.1, 0.0001, 0.01}, one, &s); /* a dense cloth beside its gaps */
    assert_int_equal(s.n, 0);
    check_rows(usual, (const double[5]){0.1, 0.1, 0.1, 0.000001, 0.01}, one, &s);
    assert_int_equal(s.n, 1);
    assert_non_null(strstr(s.text[0], "'row-3' is dark"));
    check_rows(usual, (const double[5]){0.1, 2.0, 0.1, 0.3, 80}, one, &s); /* a highlight; the lamp through a gap */
    assert_int_equal(s.n, 0);
    check_rows(usual, (const double[5]){0.1, 0.1, 999999, 200, 0.3}, one, &s);
    assert_int_equal(s.n, 2);
    assert_non_null(strstr(s.text[0], "'row-2' is brighter than any cloth: its radiance is 1e+06"));
    assert_non_null(strstr(s.text[1], "'row-3' is brighter"));
    check_rows(usual, (const double[5]){300, 300, 300, 200, 200}, one, &s);
    assert_int_equal(s.n, 4);
    assert_non_null(strstr(s.text[2], "'row-2' is brighter"));
    assert_string_equal(s.text[3], "2 more rows are brighter than any cloth");
}

/* Number of warnings for two rows that contradict each other. */
static size_t warnings_of(const struct configuration *a, const struct configuration *b)
{
    struct observation item[2] = {{.name = "a", .configuration = *a, .mean_rgb = {0.2, 0.2, 0.2}, .weight = 1},
                                  {.name = "b", .configuration = *b, .mean_rgb = {0.3, 0.3, 0.3}, .weight = 1}};
    const struct observation_set o = {.n = 2, .capacity = 2, .item = item};
    struct said s = {0};
    observation_set_check(&o, &(struct warning_sink){listen, &s});
    return s.n;
}

/* The same position of lamp and camera above the cloth can be written in many ways. */
static void test_names_of_one_configuration(void **state)
{
    (void)state;
    static const double deg = RAD_PER_DEG;
    static const struct case_of {
        double a[5], b[5]; /* degrees: light theta, phi, camera theta, phi, rotation */
        uint32_t n_rotation;
        bool same;
    } cases[] = {
        {{45, 0, 45, 180, 0}, {45, 0, 45, 180, 0}, 1, true},
        {{45, 0, 45, 180, 0}, {45, 0, 45, -180, 0}, 1, true},
        {{45, 0, 45, 180, 0}, {45, 360, 45, 180, 0}, 1, true},
        {{45, 0, 45, 180, 0}, {45, 0, 45, 180, 360}, 1, true},
        {{45, 0, 45, 180, 90}, {45, 0, 45, 180, -270}, 1, true},
        {{45, 0, 0, 180, 0}, {45, 0, 0, 30, 0}, 1, true},
        {{0, 10, 45, 180, 0}, {0, -90, 45, 180, 0}, 1, true},
        {{45, 0, 45, 180, 0}, {45, 90, 45, 270, 90}, 1, true}, /* everything turned */
        {{45, 0, 45, 180, 0}, {45, 0, 45, 180, 90}, 1, false},
        {{45, 0, 45, 90, 0}, {45, 0, 45, -90, 0}, 1, false},
        {{45, 0, 45, 180, 0}, {135, 0, 45, 180, 0}, 1, false},
        {{45, 0, 45, 180, 0}, {45, 0.01, 45, 180, 0}, 1, false},
        {{45, 0, 45, 180, 0}, {45, 90, 45, 270, 0}, 9, true},
        {{0, 0, 45, 180, 0}, {0, 0, 45, 30, 0}, 9, true},
        {{45, 0, 45, 90, 0}, {45, 0, 45, -90, 0}, 9, false},
        {{0, 0, 45, 180, 0}, {0, 0, 60, 180, 0}, 9, false},
        {{45, 0, 0, 180, 0}, {60, 0, 0, 180, 0}, 9, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct configuration c[2];
        for (int k = 0; k < 2; k++) {
            const double *v = k == 0 ? cases[i].a : cases[i].b;
            c[k] = (struct configuration){.light_theta_rad = v[0] * deg,
                                          .light_phi_rad = v[1] * deg,
                                          .camera_theta_rad = v[2] * deg,
                                          .camera_phi_rad = v[3] * deg,
                                          .cloth_rotation_rad = v[4] * deg,
                                          .n_rotation = cases[i].n_rotation};
        }
        if (warnings_of(&c[0], &c[1]) != (cases[i].same ? 1 : 0)) fail_msg("case %zu", i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fewer_numbers_than_parameters),
        cmocka_unit_test(test_contradictory),
        cmocka_unit_test(test_all_zero),
        cmocka_unit_test(test_one_dark_row),
        cmocka_unit_test(test_no_row_has_weight),
        cmocka_unit_test(test_failing_model),
        cmocka_unit_test(test_warnings),
        cmocka_unit_test(test_too_dark_and_too_bright),
        cmocka_unit_test(test_names_of_one_configuration),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
