/* What a plain BRDF expects between the rows of a fit: radiances, weights, and what each fold of a cross-validation
 * knows of them; and a fit that listens to them. */
#include "base/angle.h"
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/baseline/expected_rows.h"
#include "optimizer/fit/baseline/plain_brdf.h"
#include "tests/support/descent_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const struct plain_brdf truth = {
    {0.2, 0.1, 0.05}, {0.05, 0.04, 0.06}, {0.1, 0.2, 0.0}, {0.3, 0.2, 0.1}, 0.7, 0.4, 0.3, false};

enum { N_FIT = 16 };

/* Rows of the BRDF above over the front side, the brightness of each off by up to `error` to both sides. */
static void make_rows(struct observation_set *rows, size_t n, double error)
{
    static const double theta[] = {10, 30, 45, 60, 70}, phi[] = {180, 130, 60, 10};
    struct error err;
    observation_set_init(rows);
    for (size_t i = 0; i < n; i++) {
        struct observation o = {.set = JOB_SET_FIT, .weight = 1.0};
        o.configuration.light_theta_rad = theta[i % 5] * RAD_PER_DEG;
        o.configuration.camera_theta_rad = theta[(i / 4 + 2 * i) % 5] * RAD_PER_DEG;
        o.configuration.camera_phi_rad = phi[i % 4] * RAD_PER_DEG;
        o.configuration.crop_m = 0.01;
        plain_brdf_radiance(&truth, &o.configuration, o.mean_rgb);
        for (size_t c = 0; c < 3; c++) o.mean_rgb[c] *= 1.0 + error * sin(7.0 * (double)i);
        assert_int_equal(observation_set_append(rows, &o, &err), STATUS_OK);
    }
}

/* Expects the rows, which the caller releases. */
static void expect(const struct observation_set *rows, double strength, struct expected_rows *e,
                   struct observation_set *out)
{
    struct error err = {0};
    observation_set_init(out);
    if (expected_rows_append(rows, strength, e, out, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(e->n, out->n);
}

static void test_radiances_between_the_rows(void **state)
{
    (void)state;
    struct observation_set rows, out;
    struct expected_rows e;
    make_rows(&rows, N_FIT, 0.0);
    expect(&rows, 1.0, &e, &out);
    assert_int_equal(out.n, EXPECTED_ROWS);
    for (size_t i = 0; i < out.n; i++) {
        const struct observation *o = &out.item[i];
        double rgb[3];
        plain_brdf_radiance(&truth, &o->configuration, rgb);
        for (size_t c = 0; c < 3; c++) assert_true(fabs(o->mean_rgb[c] - rgb[c]) < 2e-3 * rgb[c] + 1e-5);
        assert_true(o->expected && !observation_is_measured_mean(o) && o->set == JOB_SET_FIT);
        assert_true(o->configuration.light_theta_rad <= 70.0 * RAD_PER_DEG + 1e-9);
        assert_true(o->configuration.camera_theta_rad <= 70.0 * RAD_PER_DEG + 1e-9);
        assert_true(o->configuration.crop_m == 0.01);
    }
    observation_set_release(&out);
    observation_set_release(&rows);
}

/* The weights are in proportion to the strength, and small where the BRDF does not describe the rows. */
static void test_weights(void **state)
{
    (void)state;
    struct observation_set rows, out;
    struct expected_rows e;
    double count[3];
    const double error[3] = {0.05, 0.05, 0.2}, strength[3] = {1.0, 0.5, 1.0};
    for (size_t k = 0; k < 3; k++) {
        make_rows(&rows, 8, error[k]);
        expect(&rows, strength[k], &e, &out);
        double sum = 0.0, least = INFINITY, most = 0.0;
        for (size_t i = 0; i < out.n; i++) {
            sum += out.item[i].weight;
            least = fmin(least, out.item[i].weight);
            most = fmax(most, out.item[i].weight);
        }
        assert_true(least < 0.7 * most); /* the BRDF is not equally sure everywhere */
        count[k] = e.count;
        assert_true(fabs(sum - e.count) < 1e-9 * sum);
        observation_set_release(&out);
        observation_set_release(&rows);
    }
    print_message("rows off by 5 %%: as much as %.2f measured rows; by 20 %%: %.2f\n", count[0], count[2]);
    assert_true(fabs(count[1] - 0.5 * count[0]) < 1e-9 * count[0]);
    assert_true(count[2] < 0.2 * count[0]);
    make_rows(&rows, 8, 0.0);
    expect(&rows, 1.0, &e, &out);
    for (size_t i = 0; i < out.n; i++) assert_true(out.item[i].weight <= 1.0);
    observation_set_release(&out);
    observation_set_release(&rows);
}

/* What a fold expects does not change with the rows that it leaves out. */
static void test_a_fold_does_not_know_its_rows(void **state)
{
    (void)state;
    struct observation_set rows, out, changed;
    struct expected_rows e, other;
    make_rows(&rows, 8, 0.05);
    expect(&rows, 1.0, &e, &out);
    for (size_t c = 0; c < 3; c++) rows.item[5].mean_rgb[c] *= 1.5;
    expect(&rows, 1.0, &other, &changed);
    bool same_fold = true, same_others = true, same_mean = true;
    for (size_t i = 0; i < out.n; i++) {
        const double *a = out.item[i].left_out_rgb, *b = changed.item[i].left_out_rgb;
        same_mean = same_mean && memcmp(out.item[i].mean_rgb, changed.item[i].mean_rgb, 3 * sizeof *a) == 0;
        same_fold = same_fold && memcmp(a + 3 * 5, b + 3 * 5, 3 * sizeof *a) == 0;
        same_others = same_others && memcmp(a, b, 3 * sizeof *a) == 0;
    }
    assert_true(same_fold && !same_others && !same_mean);
    observation_set_release(&changed);
    observation_set_release(&out);
    observation_set_release(&rows);
}

static void expect_none(const struct observation_set *rows, double strength)
{
    struct observation_set out;
    struct expected_rows e;
    expect(rows, strength, &e, &out);
    assert_int_equal(out.n, 0);
    observation_set_release(&out);
}

static void test_where_nothing_is_expected(void **state)
{
    (void)state;
    struct observation_set rows;
    make_rows(&rows, N_FIT, 0.0);
    expect_none(&rows, 0.0);
    rows.item[3].configuration.environment_rgb[1] = 0.1;
    expect_none(&rows, 1.0);
    observation_set_release(&rows);
    make_rows(&rows, FOLDS_LEAST - 1, 0.0);
    expect_none(&rows, 1.0);
    observation_set_release(&rows);
    make_rows(&rows, N_FIT, 0.0);
    for (size_t i = 0; i < rows.n; i++) rows.item[i].configuration.light_theta_rad = 150.0 * RAD_PER_DEG;
    expect_none(&rows, 1.0);
    observation_set_release(&rows);
}

/* ---- a fit that listens ---- */

static double left_out[FAKE_N_HELD_OUT][3 * FOLDS_MAX];

/* Adds the held-out places of the analytic cloth, without noise of tracing, as expected rows of the true radiance times
 * `factor`, and of `fold_factor` in each fold. */
static void listen(struct descent_fixture *x, double weight, double factor, double fold_factor)
{
    descent_fixture_init(x, 3, 0);
    x->cloth.noise = 0.0;
    x->problem.report = NULL;
    observation_set_release(&x->observation);
    fake_cloth_init(&x->cloth, 3, FAKE_N_FIT + FAKE_N_HELD_OUT);
    x->cloth.noise = 0.0;
    x->estimator = fake_estimator(&x->cloth);
    assert_int_equal(fake_observe(&x->cloth, x->truth, 0.05, 3, &x->observation), STATUS_OK);
    for (size_t i = 0; i < x->observation.n; i++) {
        struct observation *o = &x->observation.item[i];
        memset(o->se_rgb, 0, sizeof o->se_rgb);
        if (i < FAKE_N_FIT) continue;
        double rgb[3];
        fake_radiance(&o->configuration, x->truth, rgb, NULL);
        o->expected = true;
        o->weight = weight;
        o->left_out_rgb = left_out[i - FAKE_N_FIT];
        for (size_t c = 0; c < 3; c++) {
            o->mean_rgb[c] = factor * rgb[c];
            for (size_t k = 0; k < FOLDS_MAX; k++) left_out[i - FAKE_N_FIT][3 * k + c] = fold_factor * rgb[c];
        }
    }
}

static void fit(struct descent_fixture *x, struct fit_result *r)
{
    struct error err = {0};
    if (descent_find(method_gauss_newton.id)->run(&x->problem, r, &err) != STATUS_OK) fail_msg("%s", err.text);
    observation_set_release(&x->observation);
}

static double held_out(const struct descent_fixture *x, const struct fit_result *r)
{
    return fake_rel_rms(&x->cloth, FAKE_N_FIT, FAKE_N_HELD_OUT, r->param, x->truth);
}

/* Right expectations lead a fit of wrong rows to the truth; they are no rows of the cross-validation or the misfit. */
static void test_a_fit_listens(void **state)
{
    (void)state;
    struct descent_fixture x;
    struct fit_result deaf, listening;
    listen(&x, 1e-9, 1.0, 1.0);
    fit(&x, &deaf);
    double without = held_out(&x, &deaf);
    listen(&x, 1.0, 1.0, 1.0);
    fit(&x, &listening);
    double with = held_out(&x, &listening);
    print_message("held out %.4f, with right expectations %.4f; misfit %.4f, %.4f\n", without, with,
                  sqrt(deaf.uncertainty.misfit_var), sqrt(listening.uncertainty.misfit_var));
    assert_true(with < 0.5 * without);
    assert_int_equal(listening.cross_validation.n_row, deaf.cross_validation.n_row);
    assert_true(sqrt(listening.uncertainty.misfit_var) > 0.05); /* that of the measured rows alone */
}

/* Where the folds expect something else than the fit, rows that are left out are predicted from that. */
static void test_folds_have_their_own_expectations(void **state)
{
    (void)state;
    struct descent_fixture x;
    struct fit_result same, other;
    listen(&x, 1.0, 1.0, 1.0);
    fit(&x, &same);
    listen(&x, 1.0, 1.0, 1.3);
    fit(&x, &other);
    print_message("cross-validation %.4f, with other expectations in the folds %.4f\n", same.cross_validation.rel_rms,
                  other.cross_validation.rel_rms);
    assert_memory_equal(same.param, other.param, FAKE_N_PARAM * sizeof *same.param);
    assert_true(other.cross_validation.rel_rms > 1.5 * same.cross_validation.rel_rms);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_radiances_between_the_rows),
        cmocka_unit_test(test_weights),
        cmocka_unit_test(test_a_fold_does_not_know_its_rows),
        cmocka_unit_test(test_where_nothing_is_expected),
        cmocka_unit_test(test_a_fit_listens),
        cmocka_unit_test(test_folds_have_their_own_expectations),
    };
    return cmocka_run_group_tests_name("expected_rows", tests, NULL, NULL);
}
