/* Random numbers: known answers of Philox4x32-10, and moments against their standard errors. */
#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

/* Vectors of the Random123 distribution (kat_vectors, philox4x32 10). */
static const struct {
    uint32_t counter[4], key[2], answer[4];
} known[] = {
    {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
    {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
     {0xffffffff, 0xffffffff},
     {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
    {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
     {0xa4093822, 0x299f31d0},
     {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
};

static void test_known_answers(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        struct rng r = {.n_left = 0};
        memcpy(r.counter.v, known[i].counter, sizeof known[i].counter);
        memcpy(r.key.v, known[i].key, sizeof known[i].key);
        for (size_t k = 4; k-- > 0;)
            assert_int_equal(rng_u32(&r), known[i].answer[k]); /* the numbers of a block are used from its end */
    }
}

/* The third vector again, with the key and the indices of a stream. */
static void test_stream_names_fill_the_counter(void **state)
{
    (void)state;
    const struct rng_key key = {.seed = 0x299f31d0a4093822u, .iteration = 0x0370, .replica = 7, .configuration = 0x344};
    struct rng r;
    rng_start(&r, &key, 0x13198a2e, 0x85a308d3);
    assert_int_equal(r.counter.v[0], 0);
    r.counter.v[0] = 0x243f6a88;
    assert_int_equal(rng_u32(&r), 0x24126ea1);
    assert_int_equal(rng_u32(&r), 0x5001e420);
}

static void test_streams_differ(void **state)
{
    (void)state;
    const struct rng_key base = {.seed = 1};
    struct rng_key key[] = {base, base, base, base, base};
    key[1].seed = 2;
    key[2].iteration = 1;
    key[3].replica = 1;
    key[4].configuration = 1;
    uint32_t first[7];
    for (size_t i = 0; i < 7; i++) {
        struct rng r;
        rng_start(&r, &key[i < 5 ? i : 0], i == 5, i == 6);
        first[i] = rng_u32(&r);
        for (size_t j = 0; j < i; j++) assert_int_not_equal(first[i], first[j]);
    }
}

static void test_uniform_range_and_moments(void **state)
{
    (void)state;
    enum { N = 200000 };
    const struct rng_key key = {.seed = 3};
    struct rng r;
    rng_start(&r, &key, 0, 0);
    double sum[2] = {0, 0}, square[2] = {0, 0};
    for (int i = 0; i < N; i++) {
        float f = rng_float(&r);
        double d = rng_double(&r);
        assert_true(f >= 0.0f && f < 1.0f && d >= 0.0 && d < 1.0);
        const double x[2] = {(double)f, d};
        for (int k = 0; k < 2; k++) {
            sum[k] += x[k];
            square[k] += x[k] * x[k];
        }
    }
    for (int k = 0; k < 2; k++) { /* variance of u: 1/12, of u^2: 4/45 */
        assert_true(fabs(sum[k] / N - 0.5) < 5.0 * sqrt(1.0 / 12.0 / N));
        assert_true(fabs(square[k] / N - 1.0 / 3.0) < 5.0 * sqrt(4.0 / 45.0 / N));
    }
}

static void test_largest_numbers_stay_below_one(void **state)
{
    (void)state;
    struct rng r = {.n_left = 4};
    memset(r.block.v, 0xff, sizeof r.block.v);
    assert_true(rng_float(&r) < 1.0f);
    r.n_left = 4;
    assert_true(rng_double(&r) < 1.0);
}

static void test_normal_moments(void **state)
{
    (void)state;
    enum { N = 100000 };
    const struct rng_key key = {.seed = 4};
    struct rng r;
    rng_start(&r, &key, 0, 0);
    double m1 = 0, m2 = 0, m4 = 0, cross = 0;
    for (int i = 0; i < N; i++) {
        double x[2];
        rng_normal_pair(&r, x);
        m1 += x[0];
        m2 += x[0] * x[0];
        m4 += pow(x[0], 4);
        cross += x[0] * x[1];
    }
    assert_true(fabs(m1 / N) < 5.0 / sqrt(N));
    assert_true(fabs(m2 / N - 1.0) < 5.0 * sqrt(2.0 / N));
    assert_true(fabs(m4 / N - 3.0) < 5.0 * sqrt(96.0 / N)); /* variance of x^4: 105 - 9 */
    assert_true(fabs(cross / N) < 5.0 / sqrt(N));
}

static void test_poisson_moments(void **state)
{
    (void)state;
    enum { N = 50000 };
    const double mean[] = {0.1, 3.0, 29.9, 30.1, 200.0, 1e5};
    const struct rng_key key = {.seed = 5};
    for (size_t i = 0; i < sizeof mean / sizeof mean[0]; i++) {
        struct rng r;
        rng_start(&r, &key, (uint32_t)i, 0);
        double m = mean[i], sum = 0, square = 0;
        for (int k = 0; k < N; k++) {
            double x = (double)rng_poisson(&r, m) - m;
            sum += x;
            square += x * x;
        }
        assert_true(fabs(sum / N) < 5.0 * sqrt(m / N));
        /* fourth central moment: m (1 + 3 m) */
        assert_true(fabs(square / N - m) < 5.0 * sqrt((m * (1.0 + 3.0 * m) - m * m) / N));
    }
    struct rng r;
    rng_start(&r, &key, 99, 0);
    assert_int_equal(rng_poisson(&r, 0.0), 0);
    assert_int_equal(rng_poisson(&r, -1.0), 0);
    assert_int_equal(rng_poisson(&r, (double)NAN), 0);
}

/* Chi-square of counts against the Poisson law on both sides of the change of method; 30 to 60 cells, alpha about
 * 1e-6. */
static void test_poisson_law(void **state)
{
    (void)state;
    enum { N = 100000, TOP = 200 };
    const double mean[] = {20.0, 40.0};
    const struct rng_key key = {.seed = 6};
    for (size_t i = 0; i < 2; i++) {
        unsigned count[TOP] = {0};
        struct rng r;
        rng_start(&r, &key, (uint32_t)i, 0);
        for (int k = 0; k < N; k++) {
            uint64_t x = rng_poisson(&r, mean[i]);
            assert_true(x < TOP);
            count[x]++;
        }
        double chi2 = 0, cells = 0;
        for (int x = 0; x < TOP; x++) {
            double expected = N * exp(x * log(mean[i]) - mean[i] - lgamma(x + 1.0));
            if (expected < 10.0) continue;
            chi2 += pow(count[x] - expected, 2) / expected;
            cells++;
        }
        assert_true(chi2 < cells + 5.0 * sqrt(2.0 * cells));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_answers),
        cmocka_unit_test(test_stream_names_fill_the_counter),
        cmocka_unit_test(test_streams_differ),
        cmocka_unit_test(test_uniform_range_and_moments),
        cmocka_unit_test(test_largest_numbers_stay_below_one),
        cmocka_unit_test(test_normal_moments),
        cmocka_unit_test(test_poisson_moments),
        cmocka_unit_test(test_poisson_law),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
