/* Which photograph to take next: against the update of the whole covariance, and a parameter that one candidate alone
 * can determine. */
#include "optimizer/objective/next_photograph.h"
#include "optimizer/objective/small_matrix.h"
#include "tests/support/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N = FAKE_N_PARAM };

static double ln_det(const double *a, size_t n)
{
    double value[SCATTERING_MAX_PARAM], vector[SCATTERING_MAX_PARAM * SCATTERING_MAX_PARAM], sum = 0.0;
    small_eigen(a, n, value, vector);
    for (size_t i = 0; i < n; i++) sum += log(value[i]);
    return sum;
}

/* cov_after = (cov^-1 + J'J / v)^-1, and the fall of its determinant. */
static void test_against_the_whole_matrix(void **state)
{
    (void)state;
    struct fit_option o;
    struct fit_parameter parameter[N];
    struct uncertainty u = {.n_param = N, .misfit_var = 1e-4, .noise_var = 1e-4, .photograph_var = 3e-4};
    struct candidate_score score;
    struct estimate e = {.n_path = 1};
    double param[N], before[N * N], information[N * N], after[N * N], slope[N];
    struct configuration c = {.light_theta_rad = 0.7, .camera_theta_rad = 0.6, .camera_phi_rad = M_PI};
    fit_option_init(&o);
    for (size_t p = 0; p < N; p++) {
        struct coordinate k;
        param[p] = 0.5 * (fake_param[p].lower + fake_param[p].upper);
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, param[p], false};
        coordinate_init(&k, &fake_param[p], fake_param[p].lower, fake_param[p].upper);
        slope[p] = coordinate_slope(&k, param[p]);
        for (size_t q = 0; q < N; q++) u.cov[p * N + q] = p == q ? 0.02 : 0.004 * cos((double)(p * q));
    }
    for (size_t p = 0; p < N; p++)
        for (size_t q = 0; q < p; q++) u.cov[p * N + q] = u.cov[q * N + p];
    for (size_t p = 0; p < N; p++) u.se_param[p] = slope[p] * sqrt(u.cov[p * N + p]);
    memcpy(before, u.cov, sizeof before);
    fake_radiance(&c, param, e.mean, e.jac);
    next_photograph_score(fake_param, parameter, param, &u, o.leader, o.ratio, &e, &e, &score);
    double a = (e.mean[0] + e.mean[1] + e.mean[2]) / 3.0, v = 5e-4;
    assert_true(small_invert(before, N, information));
    for (size_t p = 0; p < N; p++)
        for (size_t q = 0; q < N; q++)
            for (size_t k = 0; k < 3; k++)
                information[p * N + q] += slope[p] * slope[q] * e.jac[k * N + p] * e.jac[k * N + q] / (a * a * v);
    assert_true(small_invert(information, N, after));
    assert_true(fabs(score.information - 0.5 * (ln_det(before, N) - ln_det(after, N))) < 1e-6);
    assert_true(score.information > 0.1);
    for (size_t p = 0; p < N; p++)
        assert_true(fabs(score.se_after[p] / (slope[p] * sqrt(after[p * N + p])) - 1.0) < 1e-6);
}

static struct configuration configuration_of(const double angle_deg[4])
{
    const double deg = M_PI / 180.0;
    return (struct configuration){.light_theta_rad = angle_deg[0] * deg,
                                  .camera_theta_rad = angle_deg[1] * deg,
                                  .camera_phi_rad = angle_deg[2] * deg,
                                  .cloth_rotation_rad = angle_deg[3] * deg};
}

/* (J'J / v + 1 / range^2)^-1 of the free parameters. */
static void covariance_of(const double (*row)[4], size_t n_row, const double *param,
                          const struct fit_parameter *parameter, double v, struct uncertainty *u)
{
    double information[N * N] = {0}, cov[N * N], slope[N];
    for (size_t p = 0; p < N; p++) {
        struct coordinate k;
        coordinate_init(&k, &fake_param[p], fake_param[p].lower, fake_param[p].upper);
        slope[p] = parameter[p].fixed ? 0.0 : coordinate_slope(&k, param[p]);
        information[p * N + p] = 12.0 / ((k.upper - k.lower) * (k.upper - k.lower));
    }
    for (size_t i = 0; i < n_row; i++) {
        struct configuration c = configuration_of(row[i]);
        double rgb[3], jac[3 * N];
        fake_radiance(&c, param, rgb, jac);
        double a = (rgb[0] + rgb[1] + rgb[2]) / 3.0;
        for (size_t j = 0; j < N * N * 3; j++) {
            size_t p = j / 3 / N, q = j / 3 % N, k = j % 3;
            information[p * N + q] += slope[p] * slope[q] * jac[k * N + p] * jac[k * N + q] / (a * a * v);
        }
    }
    assert_true(small_invert(information, N, cov));
    for (size_t p = 0; p < N; p++) {
        for (size_t q = 0; q < N; q++)
            u->cov[p * N + q] = parameter[p].fixed || parameter[q].fixed ? 0.0 : cov[p * N + q];
        double uniform = (parameter[p].upper - parameter[p].lower) / sqrt(12.0);
        u->se_param[p] = fmin(slope[p] * sqrt(u->cov[p * N + p]), uniform);
        u->determined[p] = parameter[p].fixed || u->se_param[p] < 0.5 * uniform;
    }
}

/* Photographs far from the mirror direction say nothing of beta_R; of several candidates one looks into it. */
static void test_finds_what_is_missing(void **state)
{
    (void)state;
    static const double row[8][4] = {{20, 60, 0, 0}, {60, 30, 60, 0},  {70, 20, 0, 0},  {50, 50, 0, 0},
                                     {20, 60, 0, 90}, {60, 30, 60, 90}, {70, 20, 0, 90}, {50, 50, 0, 90}};
    static const double candidate[5][4] = {{30, 60, 0, 0}, {65, 0, 0, 45}, {75, 10, 0, 0}, {45, 41, 180, 0}, {60, 40, 0, 90}};
    static const double file_unit[N] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 4.0, 20.0, 20.0};
    const double v = 1e-4; /* photographs good to 1 % */
    static const bool fixed[N] = {true, true, true, false, false, false, false, true, false};
    struct fit_parameter parameter[N];
    struct fit_option option;
    struct uncertainty u = {.n_param = N, .misfit_var = v};
    double param[N], best = -1.0;
    size_t i_best = 0;
    fit_option_init(&option);
    fake_param_set(file_unit, param);
    for (size_t p = 0; p < N; p++)
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, param[p], fixed[p]};
    covariance_of(row, 8, param, parameter, v, &u);
    assert_false(u.determined[6]);
    for (size_t i = 0; i < 5; i++) {
        struct configuration c = configuration_of(candidate[i]);
        struct estimate e = {.n_path = 1};
        struct candidate_score score;
        fake_radiance(&c, param, e.mean, e.jac);
        next_photograph_score(fake_param, parameter, param, &u, option.leader, option.ratio, &e, &e, &score);
        print_message("candidate %zu: %.2f nats, beta_R %.2f -> %.2f degrees%s\n", i, score.information,
                      u.se_param[6] * 180.0 / M_PI, score.se_after[6] * 180.0 / M_PI,
                      score.determines[6] ? ", determined" : "");
        assert_true(score.information >= 0.0 && score.se_after[7] == 0.0);
        assert_int_equal(score.determines[6], i == 3);
        if (score.information > best) {
            best = score.information;
            i_best = i;
        }
        /* rough derivatives make a candidate look worse */
        double exact = score.information;
        for (size_t k = 0; k < 3; k++) e.jac_var[k * N + 6] = pow(e.mean[k] / param[6], 2.0);
        next_photograph_score(fake_param, parameter, param, &u, option.leader, option.ratio, &e, &e, &score);
        assert_true(score.information < exact);
        assert_false(score.determines[6]);
    }
    assert_int_equal(i_best, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_against_the_whole_matrix),
                                       cmocka_unit_test(test_finds_what_is_missing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
