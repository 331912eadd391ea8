/* Columns of known light and known noise: the errors that they state, and the curvature that is removed. */
#include "base/rng.h"
#include "optimizer/photographs/rows/column_errors.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N_COLUMN = 13, N_DRAW = 60, N_PART = PHOTOGRAPH_PARTS };
static const double other_error = 0.01, gradient = 0.05;

/* A highlight over all 13 columns. In: steps from its middle. */
static double light(double steps) { return 0.4 + 2.0 * exp(-0.5 * steps * steps / 4.0); }

/* The same over a column, by an integral of its own. */
static double light_of_column(double steps)
{
    double sum = 0.0, weights = 0.0;
    for (int i = 0; i < 400; i++) {
        const double t = ((double)i + 0.5) / 400.0 - 0.5, weight = 1.0 - fabs(2.0 * t);
        sum += weight * light(steps + t);
        weights += weight;
    }
    return sum / weights;
}

/* Column i, whose parts have noise of the standard deviation sd about a gradient; each part shares `share` of the noise
 * of the next one before it is scaled. */
static struct observation draw_column(struct rng *rng, size_t i, double sd, double share)
{
    struct observation row = {.column = {.number = i + 1, .n = N_COLUMN, .angle_deg = 6.0 * (double)i}};
    row.photograph.n_part = N_PART;
    for (size_t c = 0; c < 3; c++) {
        const double seen = light_of_column((double)i - 0.5 * (N_COLUMN - 1));
        double noise[N_PART + 2], square = 0.0;
        for (size_t b = 0; b < N_PART + 2; b += 2) rng_normal_pair(rng, noise + b);
        for (size_t b = 0; b < N_PART; b++) {
            const double e = sd * (noise[b] + share * noise[b + 1]) / sqrt(1.0 + share * share);
            row.photograph.part_rgb[b][c] = seen * (1.0 + gradient * ((double)b - 3.5) / 3.5 + e);
            row.mean_rgb[c] += row.photograph.part_rgb[b][c] / N_PART;
        }
        for (size_t b = 0; b < N_PART; b++)
            square += pow(row.photograph.part_rgb[b][c] - row.mean_rgb[c], 2.0) / (N_PART - 1.0) / N_PART;
        row.se_rgb[c] = hypot(sqrt(square), other_error * row.mean_rgb[c]);
    }
    return row;
}

/* The stated variances and the squares of the true errors against the variance that was drawn. A highlight and a
 * gradient along the axis are no errors. The parts have 6 degrees of freedom in 13 columns and 3 channels, so one draw
 * tells a variance to sqrt(2 / 234) = 9 %, and how alike parts are to 0.065, which is 11 % of a variance: 60 draws
 * to 2 %. Squares of true errors: sqrt(2 / (60 39)) = 3 %. The removal of the curvature makes noise 5 % larger. */
static void check_errors(double sd, double share)
{
    struct rng rng;
    const double r = share / (1.0 + share * share), n = N_PART;
    const double of_noise = sd * sd * (1.0 + 2.0 * r * (n - 1.0) / n) / n;
    double stated = 0.0, true_square = 0.0;
    rng_start(&rng, &(struct rng_key){.seed = 8}, 0, 0);
    for (int k = 0; k < N_DRAW; k++) {
        struct observation_set o;
        observation_set_init(&o);
        for (size_t i = 0; i < N_COLUMN; i++) {
            const struct observation row = draw_column(&rng, i, sd, share);
            assert_int_equal(observation_set_append(&o, &row, NULL), STATUS_OK);
        }
        column_errors_state(&o, 0);
        for (size_t i = 0; i < 3 * N_COLUMN; i++) {
            const struct observation *row = &o.item[i / 3];
            const double wanted = light((double)(i / 3) - 0.5 * (N_COLUMN - 1)), seen = row->mean_rgb[i % 3];
            stated += (pow(row->se_rgb[i % 3] / seen, 2.0) - other_error * other_error) / (3 * N_COLUMN * N_DRAW);
            true_square += pow(seen / wanted - 1.0, 2.0) / (3 * N_COLUMN * N_DRAW);
        }
        observation_set_release(&o);
    }
    if (fabs(stated / of_noise - 1.0) > 0.1) fail_msg("noise of %.4f is stated as %.4f", sqrt(of_noise), sqrt(stated));
    if (true_square / of_noise < 0.88 || true_square / of_noise > 1.25)
        fail_msg("noise of %.4f, true errors of %.4f", sqrt(of_noise), sqrt(true_square));
}

static void test_known_noise(void **state)
{
    (void)state;
    check_errors(0.02 * sqrt(8.0), 0.0); /* 2 % of a column */
    check_errors(0.02 * sqrt(8.0), 0.6); /* texture that is longer than a part, or turns within two */
    check_errors(0.02 * sqrt(8.0), -0.3);
}

/* The outline's error times the slope of the light, where parts tell nothing. */
static void test_turned_outline(void **state)
{
    struct observation_set o;
    (void)state;
    observation_set_init(&o);
    for (size_t i = 0; i < 20; i++) {
        struct observation row = {.column = {.number = i + 1, .n = 20, .angle_deg = (double)i, .angle_se_deg = 0.5},
                                  .mean_rgb = {1.0, (double)i, 1.0},
                                  .se_rgb = {0.1, 0.0, 0.0}};
        assert_int_equal(observation_set_append(&o, &row, NULL), STATUS_OK);
    }
    column_errors_state(&o, 0);
    assert_true(fabs(o.item[7].se_rgb[0] - 0.1) < 1e-12 && fabs(o.item[7].se_rgb[1] - 0.5) < 1e-12);
    assert_true(o.item[7].se_rgb[2] == 0.0 && fabs(o.item[7].mean_rgb[1] - 7.0) < 1e-12);
    observation_set_release(&o);
}

/* Over a column of step h the parabola x^2 has h^2 / 24 too much. Beside a column that was left out nothing is known of
 * the curvature, so it stays. */
static void test_curvature(void **state)
{
    struct observation_set o;
    (void)state;
    observation_set_init(&o);
    for (size_t i = 0, number = 1; i < 60; i++) {
        if (i % 6 == 5) continue;
        struct observation row = {.column = {.number = number++, .n = 50, .angle_deg = 3.0 * (double)i}};
        for (size_t c = 0; c < 3; c++) row.mean_rgb[c] = 1.0 + (double)(i * i) + 1.0 / 24.0;
        assert_int_equal(observation_set_append(&o, &row, NULL), STATUS_OK);
    }
    column_errors_state(&o, 0);
    for (size_t k = 0; k < o.n; k++) {
        const double x = o.item[k].column.angle_deg / 3.0;
        const bool beside_a_gap = k % 5 == 0 || k % 5 == 4;
        const double wanted = 1.0 + x * x + (beside_a_gap ? 1.0 / 24.0 : 0.0);
        assert_true(fabs(o.item[k].mean_rgb[1] - wanted) < 1e-9);
        assert_true(o.item[k].se_rgb[1] == 0.0);
    }
    observation_set_release(&o);
}

/* A highlight of 4 degrees in columns of 6, whose width (second moment) is 4.5 % too large before. */
static void test_width_of_a_highlight(void **state)
{
    enum { N = 17 };
    struct observation_set o;
    double sum[2] = {0}, square[2] = {0};
    (void)state;
    observation_set_init(&o);
    for (size_t i = 0; i < N; i++) {
        struct observation row = {.column = {.number = i + 1, .n = N, .angle_deg = 6.0 * ((double)i - 8.0)}};
        for (int k = 0; k < 400; k++) {
            const double t = ((double)k + 0.5) / 400.0 - 0.5, at = row.column.angle_deg + 6.0 * t;
            for (size_t c = 0; c < 3; c++)
                row.mean_rgb[c] += (1.0 - fabs(2.0 * t)) / 200.0 * (0.2 + exp(-0.5 * at * at / 16.0));
        }
        assert_int_equal(observation_set_append(&o, &row, NULL), STATUS_OK);
    }
    for (size_t pass = 0; pass < 2; pass++) {
        for (size_t i = 0; i < N; i++) {
            const double m = o.item[i].mean_rgb[0] - 0.2, a = o.item[i].column.angle_deg;
            sum[pass] += m;
            square[pass] += m * a * a;
        }
        if (pass == 0) column_errors_state(&o, 0);
    }
    assert_true(fabs(sqrt(square[0] / sum[0]) / 4.0 - 1.045) < 0.005);
    assert_true(fabs(sqrt(square[1] / sum[1]) / 4.0 - 1.0) < 0.005);
    observation_set_release(&o);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_noise),
        cmocka_unit_test(test_turned_outline),
        cmocka_unit_test(test_curvature),
        cmocka_unit_test(test_width_of_a_highlight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
