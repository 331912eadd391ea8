/* The discrepancy of a cloth: a smooth reciprocal factor, its fit to rows, and its share by cross-validation. */
#include "base/angle.h"
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/baseline/discrepancy_fit.h"
#include "tests/support/descent_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ln of a factor that is smooth in the larger angle and in the half angle, one value for each channel. */
static void smooth_log_factor(const double x[DISCREPANCY_COORDINATES], double log_rgb[3])
{
    log_rgb[0] = 0.15 * cos(2.0 * x[3]) - 0.1 * x[0];
    log_rgb[1] = 0.1 * sin(x[1] + x[0]);
    log_rgb[2] = -0.12 * x[3];
}

/* A row in which the cloth is rendered grey and measured times the smooth factor. */
static struct observation make_row(double light_deg, double camera_deg, double phi_deg)
{
    struct observation o = {.set = JOB_SET_FIT, .weight = 1.0, .mean_rgb = {0.1, 0.1, 0.1}};
    o.configuration.light_theta_rad = light_deg * RAD_PER_DEG;
    o.configuration.camera_theta_rad = camera_deg * RAD_PER_DEG;
    o.configuration.camera_phi_rad = phi_deg * RAD_PER_DEG;
    struct discrepancy_row row;
    double log_rgb[3];
    discrepancy_row_of(&o, o.mean_rgb, &row);
    smooth_log_factor(row.place, log_rgb);
    for (int c = 0; c < 3; c++) o.mean_rgb[c] *= exp(log_rgb[c]);
    return o;
}

static size_t make_rows(struct discrepancy_row *row)
{
    static const double theta[] = {10, 30, 45, 60, 72}, phi[] = {0, 60, 120, 180};
    static const double grey[3] = {0.1, 0.1, 0.1};
    size_t n = 0;
    for (size_t i = 0; i < 5; i++)
        for (size_t j = i; j < 5; j++)
            for (size_t k = 0; k < 4; k++) {
                const struct observation o = make_row(theta[i], theta[j], phi[k]);
                assert_true(discrepancy_applies(&o));
                discrepancy_row_of(&o, grey, &row[n++]);
            }
    return n;
}

static void factor_of(const struct discrepancy *d, const struct observation *o, bool exchanged, double factor[3])
{
    const struct configuration *c = &o->configuration;
    const double light = cos(c->light_theta_rad), camera = cos(c->camera_theta_rad);
    const double between = light * camera + sin(c->light_theta_rad) * sin(c->camera_theta_rad) * cos(c->camera_phi_rad);
    discrepancy_factor(d, exchanged ? camera : light, exchanged ? light : camera, between, factor);
}

static void test_finds_a_smooth_factor(void **state)
{
    (void)state;
    struct discrepancy_row row[64];
    struct discrepancy d, half;
    struct error err = {0};
    const size_t n = make_rows(row);
    assert_int_equal(discrepancy_fit(row, n, 1.0, &d, &err), STATUS_OK);
    assert_int_equal(discrepancy_fit(row, n, 0.5, &half, &err), STATUS_OK);
    const struct observation between[] = {make_row(20, 50, 90), make_row(52, 66, 150), make_row(38, 38, 30)};
    for (size_t i = 0; i < 3; i++) {
        double factor[3], back[3], root[3];
        factor_of(&d, &between[i], false, factor);
        factor_of(&d, &between[i], true, back);
        factor_of(&half, &between[i], false, root);
        for (int c = 0; c < 3; c++) {
            assert_true(fabs(factor[c] / (10.0 * between[i].mean_rgb[c]) - 1.0) < 0.015);
            assert_true(factor[c] == back[c]); /* reciprocal */
            assert_true(fabs(root[c] * root[c] - factor[c]) < 1e-12);
        }
    }
}

static void test_is_one_where_it_says_nothing(void **state)
{
    (void)state;
    struct discrepancy_row row[64];
    struct discrepancy d;
    struct error err = {0};
    double factor[3];
    const size_t n = make_rows(row);
    assert_int_equal(discrepancy_fit(row, n, 0.0, &d, &err), STATUS_OK);
    assert_int_equal(d.n, 0);
    discrepancy_factor(&d, 0.7, 0.7, 0.2, factor);
    assert_true(factor[0] == 1.0 && factor[1] == 1.0 && factor[2] == 1.0);
    assert_int_equal(discrepancy_fit(row, n, 1.0, &d, &err), STATUS_OK);
    discrepancy_factor(&d, -0.7, 0.7, 0.2, factor); /* light from behind */
    assert_true(factor[0] == 1.0 && factor[1] == 1.0 && factor[2] == 1.0);
    for (size_t i = 0; i < n; i++) row[i].log_ratio[0] = 5.0; /* a factor of 150 is no discrepancy */
    assert_int_equal(discrepancy_fit(row, n, 1.0, &d, &err), STATUS_OK);
    discrepancy_factor(&d, cos(0.7), cos(0.7), cos(0.9), factor);
    assert_true(fabs(factor[0] - exp(DISCREPANCY_MOST)) < 1e-12);
    struct observation o = make_row(30, 30, 90);
    o.configuration.light_theta_rad = 2.5;
    assert_false(discrepancy_applies(&o));
    o = make_row(30, 30, 90);
    o.configuration.environment_rgb[1] = 0.1;
    assert_false(discrepancy_applies(&o));
    o = make_row(30, 30, 90);
    o.expected = true;
    assert_false(discrepancy_applies(&o));
}

/* Fits the analytic cloth to photographs that are `strength` times the smooth factor off (independent of the
 * directions where scattered), without noise. */
static void cross_validate(double strength, bool scattered, struct cross_validation *v)
{
    struct descent_fixture x;
    struct fit_result *r = malloc(sizeof *r);
    struct error err = {0};
    assert_non_null(r);
    descent_fixture_init(&x, 3, 0);
    x.cloth.noise = 0.0;
    x.problem.report = NULL;
    x.problem.discrepancy = true;
    observation_set_release(&x.observation);
    observation_set_init(&x.observation);
    assert_int_equal(fake_observe(&x.cloth, x.truth, scattered ? strength : 0.0, 3, &x.observation), STATUS_OK);
    for (size_t i = 0; i < x.observation.n; i++) {
        struct observation *o = &x.observation.item[i];
        struct discrepancy_row row;
        double log_rgb[3];
        memset(o->se_rgb, 0, sizeof o->se_rgb);
        if (scattered) continue;
        discrepancy_row_of(o, o->mean_rgb, &row);
        smooth_log_factor(row.place, log_rgb);
        for (int c = 0; c < 3; c++) o->mean_rgb[c] *= exp(strength * log_rgb[c]);
    }
    if (descent_find(method_gauss_newton.id)->run(&x.problem, r, &err) != STATUS_OK) fail_msg("%s", err.text);
    *v = r->cross_validation;
    observation_set_release(&x.observation);
    free(r);
    print_message("%s: share %.2f, left out %.4f, without %.4f\n", scattered ? "scattered" : "smooth",
                  v->discrepancy_share, v->rel_rms, v->plain_rel_rms);
}

static void test_share_by_cross_validation(void **state)
{
    (void)state;
    struct cross_validation smooth, scattered;
    cross_validate(2.0, false, &smooth);
    cross_validate(0.05, true, &scattered);
    assert_true(smooth.discrepancy_share > 0.3 && smooth.rel_rms < 0.9 * smooth.plain_rel_rms);
    assert_true(scattered.discrepancy_share < smooth.discrepancy_share);
    assert_true(scattered.rel_rms <= scattered.plain_rel_rms);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_finds_a_smooth_factor),
        cmocka_unit_test(test_is_one_where_it_says_nothing),
        cmocka_unit_test(test_share_by_cross_validation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
