/* Ranking of candidates for the next photograph: against the update of the whole covariance, and with a parameter
 * that only one candidate determines. */
#include "base/angle.h"
#include "base/small_matrix.h"
#include "optimizer/fit/linear/next_photograph.h"
#include "tests/support/tracer/fake_estimator.h"

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
    double value[FIT_MAX_PARAM], vector[FIT_MAX_PARAM * FIT_MAX_PARAM], sum = 0.0;
    small_eigen(a, n, value, vector);
    for (size_t i = 0; i < n; i++) sum += log(value[i]);
    return sum;
}

/* Covariance of `n_unknown` unknowns before the candidate. The last may be a global gain. */
struct before {
    struct fit_layout layout;
    struct uncertainty u;
    double unknown[FIT_MAX_PARAM], slope[FIT_MAX_PARAM];
};

static void set_before(struct before *k, const struct fit_option *o)
{
    struct fit_parameter parameter[N];
    memset(k, 0, sizeof *k);
    for (size_t p = 0; p < N; p++)
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper,
                                              0.5 * (fake_param[p].lower + fake_param[p].upper), false};
    assert_int_equal(fit_layout_init(&k->layout, fake_param, parameter, N, o, NULL), STATUS_OK);
    const size_t n = k->layout.n_unknown;
    k->u = (struct uncertainty){.n_param = n, .misfit_var = 1e-4, .noise_var = 1e-4, .photograph_var = 3e-4};
    for (size_t p = 0; p < n; p++) {
        struct coordinate c;
        k->unknown[p] = k->layout.parameter[p].start;
        coordinate_init(&c, &k->layout.info[p], k->layout.info[p].lower, k->layout.info[p].upper);
        k->slope[p] = coordinate_slope(&c, k->unknown[p]);
        double narrow = p < N ? 1.0 : 0.1; /* the gain */
        for (size_t q = 0; q <= p; q++)
            k->u.cov[p * n + q] = k->u.cov[q * n + p] =
                narrow * (p == q ? 0.02 * narrow : 0.004 * cos((double)(p * q)));
        k->u.se_param[p] = k->slope[p] * sqrt(k->u.cov[p * n + p]);
    }
}

/* ln of the determinant of the covariance of the first N unknowns, marginal over the others. */
static double ln_det_of_parameters(const double *cov, size_t n)
{
    double part[N * N];
    for (size_t p = 0; p < N; p++)
        for (size_t q = 0; q < N; q++) part[p * N + q] = cov[p * n + q];
    return ln_det(part, N);
}

/* Compares with cov_after = (cov^-1 + J' V^-1 J)^-1 of all unknowns, and with the decrease of the determinant of its
 * block of parameters. */
static void check_against_the_whole_matrix(const struct fit_option *o)
{
    struct before k;
    struct candidate_score score;
    struct estimate e = {.n_path = 1};
    double before[FIT_MAX_PARAM * FIT_MAX_PARAM], information[FIT_MAX_PARAM * FIT_MAX_PARAM],
        after[FIT_MAX_PARAM * FIT_MAX_PARAM], j[3][FIT_MAX_PARAM], v[9], v_inverse[9];
    struct configuration c = {.light_theta_rad = 0.7, .camera_theta_rad = 0.6, .camera_phi_rad = M_PI};
    set_before(&k, o);
    const size_t n = k.layout.n_unknown;
    memcpy(before, k.u.cov, sizeof before);
    fake_radiance(&c, k.unknown, e.mean, e.jac);
    next_photograph_score(&(struct next_photograph_fit){&k.layout, k.unknown, &k.u, o->photograph_gain_sd, NULL}, &e,
                          &e, &score);
    double a = (e.mean[0] + e.mean[1] + e.mean[2]) / 3.0;
    for (size_t i = 0; i < 9; i++)
        v[i] = (i % 4 == 0 ? 5e-4 : 0.0) + pow(o->photograph_gain_sd / a, 2.0) * e.mean[i / 3] * e.mean[i % 3];
    for (size_t i = 0; i < 3; i++)
        for (size_t p = 0; p < n; p++) j[i][p] = k.slope[p] / a * (p < N ? e.jac[i * N + p] : e.mean[i]);
    assert_true(small_invert(v, 3, v_inverse));
    assert_true(small_invert(before, n, information));
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++)
            for (size_t i = 0; i < 9; i++) information[p * n + q] += j[i / 3][p] * v_inverse[i] * j[i % 3][q];
    assert_true(small_invert(information, n, after));
    double fall = 0.5 * (ln_det_of_parameters(k.u.cov, n) - ln_det_of_parameters(after, n));
    print_message("%zu unknowns: %.4f nats, by the whole matrix %.4f\n", n, score.information, fall);
    assert_true(fabs(score.information - fall) < 1e-6);
    assert_true(score.information > 0.1);
    for (size_t p = 0; p < N; p++)
        assert_true(fabs(score.se_after[p] / (k.slope[p] * sqrt(after[p * n + p])) - 1.0) < 1e-6);
}

/* The misfit at the candidate as one more unknown of the three channels: the information is the decrease of the
 * determinant of all unknowns, 1/2 ln det(V + J C J' + k 1 1') - 1/2 ln det V. */
static void test_misfit_is_an_unknown(void **state)
{
    (void)state;
    const struct misfit_prediction misfit = {.smooth_var = 3e-3, .rest_var = 2e-5};
    const double v = misfit.rest_var + 1e-4 + 3e-4; /* noise and photograph of set_before */
    struct fit_option o;
    struct before k;
    struct candidate_score score;
    struct estimate e = {.n_path = 1};
    double all[9], a;
    struct configuration c = {.light_theta_rad = 0.7, .camera_theta_rad = 0.6, .camera_phi_rad = M_PI};
    fit_option_init(&o);
    set_before(&k, &o);
    const size_t n = k.layout.n_unknown;
    fake_radiance(&c, k.unknown, e.mean, e.jac);
    next_photograph_score(&(struct next_photograph_fit){&k.layout, k.unknown, &k.u, 0.0, &misfit}, &e, &e, &score);
    a = (e.mean[0] + e.mean[1] + e.mean[2]) / 3.0;
    for (size_t i = 0; i < 9; i++) {
        all[i] = misfit.smooth_var + (i % 4 == 0 ? v : 0.0);
        for (size_t p = 0; p < n; p++)
            for (size_t q = 0; q < n; q++)
                all[i] +=
                    e.jac[i / 3 * N + p] * k.slope[p] / a * k.u.cov[p * n + q] * e.jac[i % 3 * N + q] * k.slope[q] / a;
    }
    double fall = 0.5 * (ln_det(all, 3) - 3.0 * log(v));
    print_message("%.4f nats, of them %.4f about the misfit; by the determinant %.4f\n", score.information,
                  score.misfit_information, fall);
    assert_true(fabs(score.information - fall) < 1e-6);
    assert_true(score.misfit_information > 0.5 && score.misfit_information < score.information);
}

static void test_against_the_whole_matrix(void **state)
{
    (void)state;
    struct fit_option o;
    fit_option_init(&o);
    check_against_the_whole_matrix(&o);
    o.photograph_gain_sd = 0.05;
    check_against_the_whole_matrix(&o);
    o.photograph_gain_sd = 0.0;
    o.global_gain_sd = 0.05;
    check_against_the_whole_matrix(&o);
}

static struct configuration configuration_of(const double angle_deg[4])
{
    const double deg = RAD_PER_DEG;
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

/* Photographs far from the mirror direction do not determine beta_R. One of several candidates is in that direction. */
static void test_finds_what_is_missing(void **state)
{
    (void)state;
    static const double row[8][4] = {{20, 60, 0, 0},  {60, 30, 60, 0},  {70, 20, 0, 0},  {50, 50, 0, 0},
                                     {20, 60, 0, 90}, {60, 30, 60, 90}, {70, 20, 0, 90}, {50, 50, 0, 90}};
    static const double candidate[5][4] = {
        {30, 60, 0, 0}, {65, 0, 0, 45}, {75, 10, 0, 0}, {45, 41, 180, 0}, {60, 40, 0, 90}};
    static const double file_unit[N] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 4.0, 20.0, 20.0};
    const double v = 1e-4; /* photographs good to 1 % */
    static const bool fixed[N] = {true, true, true, false, false, false, false, true, false};
    struct fit_parameter parameter[N];
    struct fit_option option;
    struct fit_layout layout;
    struct uncertainty u = {.n_param = N, .misfit_var = v};
    double param[N], best = -1.0;
    size_t i_best = 0;
    fit_option_init(&option);
    fake_param_set(file_unit, param);
    for (size_t p = 0; p < N; p++)
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, param[p], fixed[p]};
    covariance_of(row, 8, param, parameter, v, &u);
    assert_int_equal(fit_layout_init(&layout, fake_param, parameter, N, &option, NULL), STATUS_OK);
    const struct next_photograph_fit fit = {&layout, param, &u, 0.0};
    assert_false(u.determined[6]);
    for (size_t i = 0; i < 5; i++) {
        struct configuration c = configuration_of(candidate[i]);
        struct estimate e = {.n_path = 1};
        struct candidate_score score;
        fake_radiance(&c, param, e.mean, e.jac);
        next_photograph_score(&fit, &e, &e, &score);
        print_message("candidate %zu: %.2f nats, beta_R %.2f -> %.2f degrees%s\n", i, score.information,
                      angle_to_deg(u.se_param[6]), angle_to_deg(score.se_after[6]),
                      score.determines[6] ? ", determined" : "");
        assert_true(score.information >= 0.0 && score.se_after[7] == 0.0);
        assert_int_equal(score.determines[6], i == 3);
        if (score.information > best) {
            best = score.information;
            i_best = i;
        }
        /* noise of the derivatives lowers the score of a candidate */
        double exact = score.information;
        for (size_t k = 0; k < 3; k++) e.jac_var[k * N + 6] = pow(e.mean[k] / param[6], 2.0);
        next_photograph_score(&fit, &e, &e, &score);
        assert_true(score.information < exact);
        assert_false(score.determines[6]);
    }
    assert_int_equal(i_best, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_misfit_is_an_unknown),
                                       cmocka_unit_test(test_against_the_whole_matrix),
                                       cmocka_unit_test(test_finds_what_is_missing)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
