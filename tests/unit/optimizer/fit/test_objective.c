/* The objective, fit coordinates, the linear model of an objective, and uncertainty. */
#include "base/rng.h"
#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/linear/uncertainty.h"
#include "optimizer/fit/objective/objective.h"
#include "tests/support/tracer/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double mid_range[FAKE_N_PARAM] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5.0, 15.0, 20.0};

static void test_by_hand(void **state)
{
    (void)state;
    struct observation item[2] = {{.mean_rgb = {0.1, 0.2, 0.3}, .weight = 1.0},
                                  {.mean_rgb = {0.001, 0.002, 0.003}, .weight = 4.0}};
    struct observation_set o = {.n = 2, .item = item};
    struct estimate a[2] = {{.mean = {0.2, 0.2, 0.3}, .n_path = 1}, {.mean = {0.0, 0.002, 0.003}, .n_path = 1}};
    struct estimate b[2] = {{.mean = {0.3, 0.1, 0.3}, .n_path = 1}, {.mean = {0.003, 0.0, 0.003}, .n_path = 1}};
    struct objective_value v;
    assert_true(fabs(objective_weight(&item[0]) - 25.0) < 1e-9);         /* 1 / 0.2^2 */
    assert_true(fabs(objective_weight(&item[1]) - 4.0 * 2500.0) < 1e-6); /* 4 / tau^2 */
    objective_evaluate(&o, a, b, &v);
    double f0 = 25.0 * (0.1 * 0.2), f1 = 2500.0 * (-0.001 * 0.002);
    assert_true(fabs(v.value - (f0 + 4.0 * f1)) < 1e-12);
    assert_true(v.se == 0.0);
    assert_true(fabs(v.rel_rms - sqrt((f0 + f1) / 6.0)) < 1e-12 && fabs(v.rel_square - (f0 + f1) / 6.0) < 1e-12);
    a[0].var[0] = 0.02 * 0.02; /* ra^2 vb + rb^2 va - va vb with vb = 0 */
    objective_evaluate(&o, a, b, &v);
    assert_true(fabs(v.rel_square_se - 25.0 * 0.2 * 0.02 / 6.0) < 1e-12);
    assert_true(fabs(v.rel_rms_se - 0.5 * v.rel_square_se / v.rel_rms) < 1e-12);
    item[1].weight = 0.0; /* this row contributes to nothing */
    objective_evaluate(&o, a, b, &v);
    assert_true(fabs(v.value - f0) < 1e-12 && fabs(v.rel_square - f0 / 3.0) < 1e-12);
    a[0].mean[0] = 0.0; /* the product is below 0: the root is reported as 0, its square as it is */
    objective_evaluate(&o, a, b, &v);
    assert_true(v.rel_rms == 0.0 && fabs(v.rel_square + f0 / 3.0) < 1e-12 && v.rel_rms_se == sqrt(v.rel_square_se));
}

/* Each residual of a channel is divided by the measured radiance of that channel; rows of weight 0 are left out. */
static void test_channels_by_hand(void **state)
{
    (void)state;
    struct observation item[3] = {{.mean_rgb = {0.1, 0.2, 0.001}, .weight = 1.0},
                                  {.mean_rgb = {0.2, 0.1, 0.1}, .weight = 3.0},
                                  {.mean_rgb = {1.0, 1.0, 1.0}, .weight = 0.0}};
    struct observation_set o = {.n = 3, .item = item};
    struct estimate a[3] = {{.mean = {0.11, 0.2, 0.003}}, {.mean = {0.2, 0.12, 0.1}}, {.n_path = 1}};
    struct estimate b[3] = {{.mean = {0.12, 0.2, 0.003}}, {.mean = {0.2, 0.12, 0.1}}, {.n_path = 1}};
    struct objective_channels v;
    a[0].var[0] = 0.01 * 0.01;
    objective_evaluate_channels(&o, a, b, &v);
    assert_true(fabs(v.rel_rms[0] - sqrt(0.1 * 0.2 / 2.0)) < 1e-12);
    assert_true(fabs(v.rel_rms_se[0] - 0.5 * (0.2 * 0.1 / 2.0) / v.rel_rms[0]) < 1e-12); /* rb sd_a / M^2 */
    assert_true(fabs(v.rel_rms[1] - sqrt(0.2 * 0.2 / 2.0)) < 1e-12 && v.rel_rms_se[1] == 0.0);
    assert_true(fabs(v.rel_rms[2] - sqrt(1.0 / 2.0)) < 1e-12); /* 0.002 / OBJECTIVE_CHANNEL_TAU */
    o.n = 0;
    objective_evaluate_channels(&o, a, b, &v);
    assert_true(isnan(v.rel_rms[0]) && isnan(v.rel_rms_se[2]));
}

/* The product of two replicas has the mean of the true square, and its stated error is not too small. */
static void test_unbiased(void **state)
{
    (void)state;
    enum { N = 400 };
    struct fake_cloth f;
    struct observation_set o;
    double truth[FAKE_N_PARAM], param[FAKE_N_PARAM], sum = 0.0, sum2 = 0.0, stated = 0.0, exact = 0.0;
    struct estimate a[FAKE_N_FIT], b[FAKE_N_FIT];
    size_t n_path[FAKE_N_FIT];
    fake_cloth_init(&f, 3, FAKE_N_FIT);
    struct estimator e = fake_estimator(&f);
    fake_param_set(mid_range, truth);
    memcpy(param, truth, sizeof param);
    param[3] = 0.85;
    observation_set_init(&o);
    assert_int_equal(fake_observe(&f, truth, 0.0, 1, &o), STATUS_OK);
    for (size_t i = 0; i < FAKE_N_FIT; i++) {
        double rgb[3];
        fake_radiance(&f.configuration[i], param, rgb, NULL);
        exact += objective_weight(&o.item[i]) * objective_image_difference(rgb, o.item[i].mean_rgb);
        n_path[i] = 8192;
    }
    for (uint32_t k = 0; k < N; k++) {
        struct objective_value v;
        double wall_s;
        struct estimator_call call = {param, n_path, k, REPLICA_FIT_A, false};
        assert_int_equal(e.run(e.context, &call, NULL, a, &wall_s, NULL), STATUS_OK);
        call.replica = REPLICA_FIT_B;
        assert_int_equal(e.run(e.context, &call, NULL, b, &wall_s, NULL), STATUS_OK);
        objective_evaluate(&o, a, b, &v);
        sum += v.value / N;
        sum2 += v.value * v.value / N;
        stated += v.se * v.se / N;
    }
    double scatter = sum2 - sum * sum;
    assert_true(fabs(sum - exact) < 4.0 * sqrt(scatter / N));
    assert_true(stated > 0.75 * scatter &&
                stated < 3.5 * scatter); /* fully correlated channels: between 1 and 3, and its own noise */
    observation_set_release(&o);
}

static void test_gradient(void **state)
{
    (void)state;
    struct fake_cloth f;
    struct observation_set o;
    double truth[FAKE_N_PARAM], param[FAKE_N_PARAM], gradient[FAKE_N_PARAM];
    struct estimate a[FAKE_N_FIT];
    size_t n_path[FAKE_N_FIT];
    fake_cloth_init(&f, 3, FAKE_N_FIT);
    f.noise = 0.0;
    struct estimator e = fake_estimator(&f);
    fake_param_set(mid_range, truth);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) param[p] = fake_param[p].start;
    observation_set_init(&o);
    assert_int_equal(fake_observe(&f, truth, 0.0, 1, &o), STATUS_OK);
    for (size_t i = 0; i < FAKE_N_FIT; i++) n_path[i] = 256;
    struct estimator_call call = {param, n_path, 0, 0, true};
    double wall_s;
    assert_int_equal(e.run(e.context, &call, NULL, a, &wall_s, NULL), STATUS_OK);
    objective_gradient(&o, a, a, FAKE_N_PARAM, gradient);
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        double value[2], keep = param[p], h = 1e-5;
        for (int side = 0; side < 2; side++) {
            struct objective_value v;
            param[p] = keep + (side == 0 ? -h : h);
            assert_int_equal(e.run(e.context, &call, NULL, a, &wall_s, NULL), STATUS_OK);
            objective_evaluate(&o, a, a, &v);
            value[side] = v.value;
        }
        param[p] = keep;
        double difference = (value[1] - value[0]) / (2.0 * h);
        assert_true(fabs(gradient[p] - difference) < 1e-4 * fabs(difference) + 1e-4);
    }
    observation_set_release(&o);
}

static void test_coordinates(void **state)
{
    (void)state;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) {
        struct coordinate k;
        coordinate_init(&k, &fake_param[p], fake_param[p].lower, fake_param[p].upper);
        assert_int_equal(k.kind, p < 6 ? PARAM_LOGIT : PARAM_LOG);
        assert_true(coordinate_to_param(&k, k.upper) == fake_param[p].upper &&
                    coordinate_to_param(&k, k.lower) == fake_param[p].lower);
        assert_true(coordinate_to_param(&k, k.upper + 9.0) == fake_param[p].upper);
        assert_true(coordinate_from_param(&k, 99.0) == k.upper && isfinite(k.lower) && isfinite(k.upper));
        for (int i = 1; i < 20; i++) {
            double v = fake_param[p].lower + (fake_param[p].upper - fake_param[p].lower) * i / 20.0,
                   x = coordinate_from_param(&k, v);
            double difference = (coordinate_to_param(&k, x + 1e-6) - coordinate_to_param(&k, x - 1e-6)) / 2e-6;
            assert_true(fabs(coordinate_to_param(&k, x) - v) < 1e-14);
            assert_true(fabs(coordinate_slope(&k, v) / difference - 1.0) < 1e-6);
        }
    }
    struct param_info gamma = {.lower = 0.005, .upper = 1.5, .start = 0.1, .coordinate = PARAM_LOG},
                      shift = {.lower = -1.0, .upper = 1.0, .start = 0.0, .coordinate = PARAM_LINEAR};
    struct coordinate k;
    coordinate_init(&k, &gamma, gamma.lower, gamma.upper);
    assert_int_equal(k.kind, PARAM_LOG);
    coordinate_init(&k, &shift, shift.lower, shift.upper);
    assert_int_equal(k.kind, PARAM_LINEAR);
}

/* A linear model with known noise: the sandwich estimator gives the known covariance, and a parameter whose
 * derivatives are zero is reported as not determined. */
static void test_uncertainty(void **state)
{
    (void)state;
    enum { ROWS = 3 * FAKE_N_FIT };
    struct coordinate k[2];
    struct linear_model m;
    struct uncertainty u;
    bool fixed[2] = {false, false};
    assert_int_equal(linear_model_init(&m, ROWS, 2, NULL), STATUS_OK);
    for (size_t p = 0; p < 2; p++) coordinate_init(&k[p], &fake_param[6], fake_param[6].lower, fake_param[6].upper);
    double jj = 0.0, common = 0.0, of_three = 0.0;
    for (size_t row = 0; row < ROWS; row++) {
        m.photograph_var[row] = 0.01 * 0.01;
        for (int q = 0; q < 2; q++) m.j[q][2 * row] = 0.5 + 0.01 * (double)row;
        jj += m.j[0][2 * row] * m.j[0][2 * row];
        of_three = (row % 3 > 0 ? of_three : 0.0) + m.j[0][2 * row];
        if (row % 3 == 2) common += of_three * of_three;
    }
    m.x_ref[0] = m.x_ref[1] = log(fake_param[6].start);
    uncertainty_compute(&m, k, fixed, &u);
    double want =
        0.01 * sqrt(0.5 * jj + 0.5 * common) / jj; /* half of a photograph's variance is common to its channels */
    assert_true(fabs(sqrt(u.cov[0]) / want - 1.0) < 1e-2);
    assert_true(fabs(u.se_param[0] / (want * fake_param[6].start) - 1.0) < 1e-2);
    assert_true(u.determined[0] && !u.determined[1] && !u.at_bound[0]);
    assert_true(isfinite(u.se_param[1]) && u.se_param[1] > u.se_param[0]);
    m.x_ref[0] = k[0].upper;
    fixed[1] = true;
    uncertainty_compute(&m, k, fixed, &u);
    assert_true(u.at_bound[0] && u.se_param[0] > 0.0 && u.se_param[1] == 0.0 && u.determined[1]);
    linear_model_release(&m);
}

/* For a parameter with a range of decades, being at a bound is decided in its logarithm. A thousandth of the linear
 * range would be ten times the lower bound. */
static void test_bound_of_a_wide_range(void **state)
{
    (void)state;
    const struct param_info density = {.lower = 10.0, .upper = 100000.0, .start = 4000.0, .coordinate = PARAM_LOG};
    const struct {
        double value;
        bool at_bound;
    } want[] = {{10.0, true},    {10.05, true},    {10.5, false},   {105.0, false},
                {4000.0, false}, {98000.0, false}, {99500.0, true}, {100000.0, true}};
    struct coordinate k;
    struct linear_model m;
    const bool fixed = false;
    coordinate_init(&k, &density, density.lower, density.upper);
    assert_int_equal(linear_model_init(&m, 3, 1, NULL), STATUS_OK);
    for (size_t i = 0; i < sizeof want / sizeof want[0]; i++) {
        struct uncertainty u;
        m.x_ref[0] = coordinate_from_param(&k, want[i].value);
        uncertainty_compute(&m, &k, &fixed, &u);
        if (u.at_bound[0] != want[i].at_bound) fail_msg("%g of 10 to 100000", want[i].value);
    }
    linear_model_release(&m);
}

/* The means deviate by 1 % and the contrasts by 30 %. Each kind has a misfit of its own, and what is reported for means
 * (misfit, noise, stated error) comes from the means alone. */
static void test_contrasts_have_a_misfit_of_their_own(void **state)
{
    (void)state;
    enum { ROWS = 600 };
    struct linear_model m;
    struct uncertainty u;
    struct coordinate k;
    struct rng rng;
    double misfit[2], se_means_alone = 0.0;
    const bool fixed = false;
    rng_start(&rng, &(struct rng_key){.seed = 6}, 0, 0);
    assert_int_equal(linear_model_init(&m, ROWS, 1, NULL), STATUS_OK);
    coordinate_init(&k, &fake_param[6], fake_param[6].lower, fake_param[6].upper);
    m.x_ref[0] = log(fake_param[6].start);
    for (int with_contrasts = 0; with_contrasts < 2; with_contrasts++) {
        for (size_t row = 0; row < ROWS; row++) {
            double normal[4], left = row < ROWS / 2 ? 0.01 : 0.3, noise = row < ROWS / 2 ? 0.002 : 0.05;
            rng_normal_pair(&rng, normal);
            rng_normal_pair(&rng, normal + 2);
            m.contrast[row] = row >= ROWS / 2;
            m.extra[row] = row < ROWS / 2 || with_contrasts ? 1.0 : 0.0;
            m.photograph_var[row] = m.extra[row] * noise * noise;
            for (int q = 0; q < 2; q++) {
                m.r[q][row] = m.extra[row] * (left * normal[0] + noise * normal[1 + q]);
                m.r_var[q][row] = m.extra[row] * noise * noise;
                m.j[q][row] = row < ROWS / 2 ? 0.5 : 0.0; /* contrasts do not depend on this parameter */
            }
        }
        linear_model_misfits(&m, 1, misfit);
        assert_true(fabs(misfit[0] / 1e-4 - 1.0) < 0.3); /* 300 squared normals: to 8 % */
        assert_true(with_contrasts ? fabs(misfit[1] / 0.09 - 1.0) < 0.3 : misfit[1] == 0.0);
        uncertainty_compute(&m, &k, &fixed, &u);
        assert_true(u.misfit_var == misfit[0]);
        assert_true(fabs(u.noise_var / (0.5 * 0.002 * 0.002) - 1.0) < 1e-9 &&
                    fabs(u.photograph_var / (0.002 * 0.002) - 1.0) < 1e-9);
        if (with_contrasts)
            assert_true(fabs(u.se_param[0] / se_means_alone - 1.0) < 0.2);
        else
            se_means_alone = u.se_param[0];
    }
    linear_model_release(&m);
}

/* Some rows have stated errors of 0.2 % and residuals of 1 %, the other rows have stated errors of 5 %. The misfit of
 * 1 % is found in spite of the others, no misfit is found where the stated errors explain the residuals, and the
 * weights follow from it. An additional weight of rows changes neither. */
static void test_misfit_and_weights(void **state)
{
    (void)state;
    enum { ROWS = 600 };
    struct linear_model m;
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 5}, 0, 0);
    assert_int_equal(linear_model_init(&m, ROWS, 1, NULL), STATUS_OK);
    for (int explained = 0; explained < 2; explained++) {
        for (size_t row = 0; row < ROWS; row++) {
            double normal[4], se = row % 2 ? 0.05 : 0.002, left = explained ? 0.0 : 0.01;
            rng_normal_pair(&rng, normal);
            rng_normal_pair(&rng, normal + 2);
            m.extra[row] = row < ROWS / 2 ? 1.0 : 9.0;
            m.photograph_var[row] = se * se * m.extra[row];
            for (int q = 0; q < 2; q++) {
                m.r[q][row] = sqrt(m.extra[row]) * (hypot(left, se) * normal[0] + 0.002 * normal[1 + q]);
                m.r_var[q][row] = 0.002 * 0.002 * m.extra[row];
            }
        }
        double misfit = linear_model_misfit(&m, 0), noise = 0.5 * 0.002 * 0.002;
        /* 300 squared normals: 1e-4 to 8 %; below 2 % of the well-known rows' variance otherwise */
        assert_true(explained ? misfit < 0.25 * 0.002 * 0.002 : fabs(misfit / 1e-4 - 1.0) < 0.3);
        linear_model_weigh(&m, 0);
        double ratio = (misfit + noise + 0.05 * 0.05) / (misfit + noise + 0.002 * 0.002);
        assert_true(fabs(m.weight[0] / m.weight[1] / ratio - 1.0) < 1e-9);
        assert_true(fabs(m.weight[ROWS - 2] / m.weight[0] - 1.0) < 1e-9);
    }
    double misfit = linear_model_misfit(&m, 3), weight = m.weight[0];
    for (size_t row = ROWS - 300; row < ROWS; row++) /* half of the rows again, as of photographs that are left out */
        m.extra[row] = m.photograph_var[row] = m.r[0][row] = m.r[1][row] = m.r_var[0][row] = m.r_var[1][row] = 0.0;
    linear_model_weigh(&m, 3);
    assert_true(isfinite(linear_model_misfit(&m, 3)) && m.weight[ROWS - 1] == 0.0 && isfinite(m.row_var));
    double mean = 0.0;
    for (size_t row = 0; row < ROWS - 300; row++) mean += m.weight[row] / (ROWS - 300);
    assert_true(fabs(mean - 1.0) < 1e-9 && fabs(m.weight[0] / weight - 1.0) < 0.1 && misfit < 1e-5);
    for (size_t row = 0; row < ROWS; row++) m.extra[row] = 0.0;
    linear_model_weigh(&m, 3);
    assert_true(linear_model_misfit(&m, 3) == 0.0 && m.weight[0] == 0.0 && isfinite(m.row_var));
    linear_model_release(&m);
}

/* The derivative of the weighted objective along the model is the gradient, so that the predicted and the actual
 * decrease of a step refer to the same function. */
static void test_weighted_objective(void **state)
{
    (void)state;
    enum { ROWS = 12, PARAMS = 2 };
    struct linear_model m;
    struct rng rng;
    double g[PARAMS], value[2], plain = 0.0;
    rng_start(&rng, &(struct rng_key){.seed = 9}, 0, 0);
    assert_int_equal(linear_model_init(&m, ROWS, PARAMS, NULL), STATUS_OK);
    for (size_t row = 0; row < ROWS; row++) {
        m.weight[row] = 0.1 + rng_double(&rng);
        for (int q = 0; q < 2; q++) {
            m.r[q][row] = rng_double(&rng) - 0.5;
            for (size_t p = 0; p < PARAMS; p++) m.j[q][row * PARAMS + p] = rng_double(&rng) - 0.5;
        }
        plain += m.weight[row] * m.r[0][row] * m.r[1][row];
    }
    assert_true(fabs(linear_model_weighted_objective(&m) - plain) < 1e-12);
    linear_model_gradient(&m, g);
    for (size_t p = 0; p < PARAMS; p++) {
        for (int side = 0; side < 2; side++) {
            double dx = side ? 2e-4 : -1e-4; /* to 1e-4 below, from there to 1e-4 above, and back */
            for (size_t row = 0; row < ROWS; row++)
                for (int q = 0; q < 2; q++) m.r[q][row] += dx * m.j[q][row * PARAMS + p];
            value[side] = linear_model_weighted_objective(&m);
        }
        assert_true(fabs((value[1] - value[0]) / 2e-4 - g[p]) < 1e-6);
        for (size_t row = 0; row < ROWS; row++)
            for (int q = 0; q < 2; q++) m.r[q][row] -= 1e-4 * m.j[q][row * PARAMS + p];
    }
    linear_model_release(&m);
}

/* Priors add precision (x - mean)^2, in units of the rows' variance, and its derivatives. */
static void test_penalty_of_priors(void **state)
{
    (void)state;
    const struct gaussian_prior prior[2] = {{.mean = 1.0, .precision = 4.0}, {.mean = -2.0, .precision = 0.5}};
    double x[2] = {1.5, 1.0}, g[2], h[4];
    struct linear_model m = {.n_param = 2, .row_var = 0.1, .prior = prior, .x_ref = {1.5, 1.0}};
    assert_true(fabs(linear_model_penalty(&m, x) - 0.1 * (4.0 * 0.25 + 0.5 * 9.0)) < 1e-12);
    linear_model_gradient(&m, g);
    assert_true(fabs(g[0] - 0.1 * 8.0 * 0.5) < 1e-12 && fabs(g[1] - 0.1 * 1.0 * 3.0) < 1e-12);
    linear_model_hessian(&m, false, h);
    assert_true(fabs(h[0] - 0.8) < 1e-12 && h[1] == 0.0 && h[2] == 0.0 && fabs(h[3] - 0.1) < 1e-12);
    m.prior = NULL;
    assert_true(linear_model_penalty(&m, x) == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_by_hand),
        cmocka_unit_test(test_channels_by_hand),
        cmocka_unit_test(test_unbiased),
        cmocka_unit_test(test_gradient),
        cmocka_unit_test(test_coordinates),
        cmocka_unit_test(test_uncertainty),
        cmocka_unit_test(test_misfit_and_weights),
        cmocka_unit_test(test_bound_of_a_wide_range),
        cmocka_unit_test(test_contrasts_have_a_misfit_of_their_own),
        cmocka_unit_test(test_weighted_objective),
        cmocka_unit_test(test_penalty_of_priors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
