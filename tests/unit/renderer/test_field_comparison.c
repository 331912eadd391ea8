/* What bench_pictures makes of noisy fields of two pictures: the part of their difference that is no noise, its
 * standard error, and when it may say that one picture is made faster. */
#include "base/rng.h"
#include "tests/bench/pictures/field_comparison.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N_FIELD = 200, N_SAMPLE = 32, N_TRIAL = 200 };

/* Fields of radiance 2 whose second picture is off by a normal deviate of sd `error`, the same in all channels; each
 * sample has an exponential deviate of sd `noise`, which is as skewed as light of rare paths. */
static void compare(uint32_t trial, double error, double noise, struct field_comparison *r)
{
    struct field_sum sum[2][N_FIELD] = {0};
    for (uint32_t i = 0; i < N_FIELD; i++) {
        struct rng rng;
        double deviate[2];
        rng_start(&rng, &(struct rng_key){.seed = 3}, i, trial);
        rng_normal_pair(&rng, deviate);
        for (int k = 0; k < 2; k++)
            for (int s = 0; s < N_SAMPLE; s++) {
                sum[k][i].n += 1.0;
                for (int c = 0; c < 3; c++) {
                    double v = 2.0 + (k == 1 ? 2.0 * error * deviate[0] : 0.0) +
                               2.0 * noise * (-log1p(-rng_double(&rng)) - 1.0);
                    sum[k][i].x[c] += v;
                    sum[k][i].x2[c] += v * v;
                }
            }
    }
    *r = field_comparison_of(sum[0], sum[1], N_FIELD);
}

/* Over many trials the square has the mean error^2, and the standard errors are as large as it varies. */
static void square_is_unbiased(void **state)
{
    (void)state;
    const double error = 0.05, noise = 0.5; /* noise of a field 8.8 %, of both pictures 12.5 % */
    double sum = 0.0, sum2 = 0.0, se2 = 0.0;
    for (uint32_t t = 0; t < N_TRIAL; t++) {
        struct field_comparison r;
        compare(t, error, noise, &r);
        double square = field_comparison_square(&r);
        sum += square / N_TRIAL;
        sum2 += square * square / N_TRIAL;
        se2 += pow(field_comparison_square_se(&r), 2.0) / N_TRIAL;
        assert_true(fabs(field_comparison_noise(&r, 0) / (noise / sqrt(N_SAMPLE)) - 1.0) < 0.2);
    }
    double variance = (sum2 - sum * sum) * N_TRIAL / (N_TRIAL - 1.0);
    assert_true(fabs(sum - error * error) < 4.0 * sqrt(variance / N_TRIAL));
    /* a variance of 200 deviates has a relative standard error of 10 % */
    assert_true(fabs(se2 / variance - 1.0) < 0.4);
}

/* Of pictures that are apart by noise alone, the figure calls hardly any apart by more than that noise. */
static void noise_is_no_error(void **state)
{
    (void)state;
    int n_above = 0;
    for (uint32_t t = 0; t < N_TRIAL; t++) {
        struct field_comparison r;
        compare(t, 0.0, 0.5, &r);
        n_above += field_speedup_of(10.0, field_comparison_square(&r), field_comparison_square_se(&r), 0.001).verdict ==
                   FIELD_SPEEDUP_ABOVE;
    }
    assert_true(n_above <= 14); /* 2.3 % expected of normal deviates: 4.6 +- 2.1 */
}

static void verdict_needs_two_standard_errors(void **state)
{
    (void)state;
    const double goal = 0.03;
    struct field_speedup s = field_speedup_of(40.0, 3e-4, 1e-4, goal); /* (1.7 %)^2 +- 1 %^2 */
    assert_int_equal(s.verdict, FIELD_SPEEDUP_SHOWN);
    assert_true(fabs(s.value - 40.0 * 6.0 / 9.0) < 1e-9);
    assert_true(fabs(s.least - 40.0 * 4.0 / 9.0) < 1e-9);
    assert_true(field_speedup_is_settled(3e-4, 1e-4, goal));
    assert_false(field_speedup_is_settled(3e-4, 2e-4, goal)); /* shown, but the figure is known to a third only */
    s = field_speedup_of(40.0, 2e-3, 5e-4, goal);
    assert_int_equal(s.verdict, FIELD_SPEEDUP_ABOVE);
    assert_true(s.value == 0.0 && s.least == 0.0);
    assert_true(field_speedup_is_settled(2e-3, 5e-4, goal));
    /* by chance below 0, with a standard error of 12 %^2: no speedup may be named */
    s = field_speedup_of(58.0, -5e-4, 12e-4, goal);
    assert_int_equal(s.verdict, FIELD_SPEEDUP_NOT_RESOLVED);
    assert_true(s.value == 0.0 && s.least == 0.0);
    assert_false(field_speedup_is_settled(-5e-4, 12e-4, goal));
    assert_int_equal(field_speedup_of(58.0, NAN, NAN, goal).verdict, FIELD_SPEEDUP_NOT_RESOLVED);
    /* a square below 0 makes no figure larger than that at equal noise */
    s = field_speedup_of(58.0, -1e-4, 1e-4, goal);
    assert_true(s.verdict == FIELD_SPEEDUP_SHOWN && s.value == 58.0 && s.least < 58.0);
}

static void shadow_and_background_count_for_nothing(void **state)
{
    (void)state;
    const struct field_sum lit = {4.0, {4.0, 4.0, 4.0}, {4.0, 4.0, 4.0}},
                           brighter = {4.0, {6.0, 6.0, 6.0}, {9.0, 9.0, 9.0}}, dark = {.n = 4.0},
                           shadow = {4.0, {0.0, 0.01, 0.0}, {0.0, 0.0001, 0.0}}; /* one sample of four */
    const struct field_sum first[] = {lit, dark, lit, shadow}, second[] = {brighter, dark, lit, dark};
    struct field_comparison r = field_comparison_of(first, second, 4);
    assert_true(r.n == 6.0 && fabs(field_comparison_square(&r) - 0.125) < 1e-12);
    r = field_comparison_of(first, second, 1);
    assert_true(r.n == 3.0 && fabs(field_comparison_square(&r) - 0.25) < 1e-12);
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(square_is_unbiased),
        cmocka_unit_test(noise_is_no_error),
        cmocka_unit_test(verdict_needs_two_standard_errors),
        cmocka_unit_test(shadow_and_background_count_for_nothing),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
