/* Rows that share their camera paths: what their correlation does to the errors of the objective and of a parameter. */
#include "optimizer/fit/linear/uncertainty.h"
#include "optimizer/fit/objective/objective.h"
#include "tests/support/tracer/fake_estimator.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* Two rows that share their paths: correlated noise of equal residuals adds up in f and in a parameter that both rows
 * show alike, and cancels where they show it with opposite signs; with and without noise of the derivatives. */
static void test_shared_paths(void **state)
{
    (void)state;
    const double correlation = 0.6, v = 1e-4, r = 0.1;
    struct coordinate k;
    struct linear_model m;
    const bool fixed = false;
    double se, se_alone;
    assert_int_equal(linear_model_init(&m, 6, 1, NULL), STATUS_OK);
    coordinate_init(&k, &fake_param[6], fake_param[6].lower, fake_param[6].upper);
    m.x_ref[0] = log(fake_param[6].start);
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int noisy = 0; noisy < 2; noisy++) {
            struct uncertainty u, alone;
            for (size_t row = 0; row < 6; row++) {
                for (int q = 0; q < 2; q++) {
                    m.j[q][row] = row < 3 ? 1.0 : sign;
                    m.r[q][row] = noisy ? (row < 3 ? r : sign * r) : 0.0;
                    m.r_var[q][row] = v;
                    m.j_var[q][row] = noisy ? 0.01 : 0.0;
                }
            }
            m.n_pair = 0;
            uncertainty_compute(&m, &k, &fixed, &alone);
            linear_model_objective(&m, &se_alone);
            m.pair[0] = (struct linear_pair){1, 0, correlation};
            m.n_pair = 1;
            uncertainty_compute(&m, &k, &fixed, &u);
            linear_model_objective(&m, &se);
            double factor = 1.0 + sign * correlation;
            if (!noisy && fabs(u.cov[0] / alone.cov[0] / factor - 1.0) > 1e-2)
                fail_msg("sign %d: %g times the variance, not %g", sign, u.cov[0] / alone.cov[0], factor);
            if (noisy && !(sign * (u.cov[0] - alone.cov[0]) > 0.0)) fail_msg("sign %d, noisy derivatives", sign);
            /* 2 (3 r)^2 v (v of each replica) for each row and (1 +- correlation) for both; v^2 is small beside */
            if (noisy && fabs(se * se / (se_alone * se_alone) / factor - 1.0) > 0.02)
                fail_msg("sign %d: %g times the variance of f", sign, se * se / (se_alone * se_alone));
        }
    }
    linear_model_release(&m);
}

/* The part of the variance that the noise of the derivatives makes, by hand. Residuals are noise alone, so it is
 * 4 noise (var J_A + var J_B) / 4 of each row, noise being the variance of the mean residual; of two rows with the
 * correlation c, which residuals and derivatives share, (1 + c^2) times as much. The noise of the residuals makes
 * J^2 noise of each row, (1 + c) times as much of two. */
static void test_noise_of_derivatives(void **state)
{
    (void)state;
    const double v = 1e-4, jacobian = 3.0, j_var[2] = {0.02, 0.07};
    struct coordinate k;
    struct linear_model m;
    const bool fixed = false;
    assert_int_equal(linear_model_init(&m, 6, 1, NULL), STATUS_OK);
    coordinate_init(&k, &fake_param[6], fake_param[6].lower, fake_param[6].upper);
    m.x_ref[0] = log(fake_param[6].start);
    for (int n_row = 1; n_row <= 2; n_row++)
        for (int shared = 0; shared < n_row; shared++) {
            const double c = shared ? 0.6 : 0.0;
            struct uncertainty exact, noisy;
            for (size_t i = 0; i < (size_t)n_row; i++)
                for (int q = 0; q < 2; q++) {
                    m.j[q][3 * i] = jacobian;
                    m.r_var[q][3 * i] = v;
                    m.j_var[q][3 * i] = 0.0;
                }
            m.pair[0] = (struct linear_pair){1, 0, c};
            m.n_pair = (size_t)shared;
            uncertainty_compute(&m, &k, &fixed, &exact);
            const double decrease = uncertainty_noise_decrease(&m, &k, &fixed);
            for (size_t i = 0; i < (size_t)n_row; i++)
                for (int q = 0; q < 2; q++) m.j_var[q][3 * i] = j_var[q];
            uncertainty_compute(&m, &k, &fixed, &noisy);
            const double want = (j_var[0] + j_var[1]) * (1.0 + c * c) / (jacobian * jacobian * (1.0 + c));
            if (fabs((noisy.cov[0] / exact.cov[0] - 1.0) / want - 1.0) > 1e-2)
                fail_msg("%d rows, correlation %g: %g, not %g", n_row, c, noisy.cov[0] / exact.cov[0] - 1.0, want);
            const double more = uncertainty_noise_decrease(&m, &k, &fixed) / decrease - 1.0;
            if (fabs(more / want - 1.0) > 1e-2) fail_msg("%d rows, correlation %g: decrease %g", n_row, c, more);
        }
    linear_model_release(&m);
}

/* The same for the errors of scored rows: of all channels together, and of one. */
static void test_shared_paths_scored(void **state)
{
    (void)state;
    struct observation item[2] = {{.mean_rgb = {0.1, 0.2, 0.3}, .weight = 1.0},
                                  {.mean_rgb = {0.1, 0.2, 0.3}, .weight = 1.0}};
    struct observation_set o = {.n = 2, .item = item};
    struct estimate a[2], b[2];
    for (int sign = -1; sign <= 1; sign += 2) {
        struct objective_value v, alone;
        struct objective_channels channel, channel_alone;
        for (int i = 0; i < 2; i++) {
            double off = i == 0 ? 0.1 : sign * 0.1;
            a[i] = (struct estimate){.mean = {0.1 + off, 0.2, 0.3}, .var = {1e-6, 0.0, 0.0}, .n_path = 1};
            b[i] = a[i];
        }
        objective_evaluate(&o, a, b, &alone);
        objective_evaluate_channels(&o, a, b, &channel_alone);
        a[1].n_partner = b[1].n_partner = 1;
        a[1].partner[0] = b[1].partner[0] = (struct estimate_partner){0, 0.5f};
        objective_evaluate(&o, a, b, &v);
        objective_evaluate_channels(&o, a, b, &channel);
        const double factor = sqrt(1.0 + sign * 0.5);
        assert_true(v.value == alone.value && v.rel_square == alone.rel_square);
        assert_true(fabs(v.se / alone.se / factor - 1.0) < 1e-3);
        assert_true(fabs(v.rel_square_se / alone.rel_square_se / factor - 1.0) < 1e-3);
        assert_true(fabs(channel.rel_rms_se[0] / channel_alone.rel_rms_se[0] / factor - 1.0) < 1e-3);
        item[1].weight = 0.0; /* a row that is not scored adds nothing */
        objective_evaluate_channels(&o, a, b, &channel);
        a[1].n_partner = 0;
        objective_evaluate_channels(&o, a, b, &channel_alone);
        assert_true(channel.rel_rms_se[0] == channel_alone.rel_rms_se[0]);
        item[1].weight = 1.0;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shared_paths), cmocka_unit_test(test_noise_of_derivatives),
                                       cmocka_unit_test(test_shared_paths_scored)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
