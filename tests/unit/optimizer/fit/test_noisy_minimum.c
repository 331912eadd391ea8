/* The minimum of noisy functions is found within its stated error, and none is found where there is none. */
#include "base/rng.h"
#include "optimizer/fit/objective/noisy_minimum.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum shape { SHAPE_BOWL, SHAPE_LOPSIDED, SHAPE_FLAT, SHAPE_SLOPE };

struct function {
    enum shape shape;
    double at, noise;
    uint64_t seed;
    uint32_t n_call, fail_at;
};

/* A parabola with a linear term, and a function that is twice as steep on the left, like the objective of a weave
 * over the radius. */
static double value(const struct function *f, double u)
{
    double x = u - f->at;
    if (f->shape == SHAPE_FLAT) return 1.0;
    if (f->shape == SHAPE_SLOPE) return 2.0 + u;
    if (f->shape == SHAPE_LOPSIDED) return 0.4 * (exp(-2.0 * x) + 2.0 * x - 1.0);
    return 0.3 + 3.0 * (cosh(1.5 * x) - 1.0) - 0.6 * x * x * x;
}

static status evaluate(void *context, double u, double *y, double *se, struct error *err)
{
    struct function *f = context;
    const struct rng_key key = {.seed = f->seed};
    struct rng rng;
    double normal[2];
    if (++f->n_call == f->fail_at) return error_set(err, STATUS_CANCELLED, "stopped");
    rng_start(&rng, &key, f->n_call, 0);
    rng_normal_pair(&rng, normal);
    *y = value(f, u) + f->noise * normal[0];
    *se = f->noise > 0.0 ? f->noise : 1e-9;
    return STATUS_OK;
}

static const struct noisy_minimum_option option = {
    .lower = -0.7, .upper = 0.7, .n_first = 5, .n_most = 11, .tolerance = 0.01};

static void test_without_noise(void **unused)
{
    (void)unused;
    for (double at = -0.45; at < 0.5; at += 0.09) {
        struct function f = {.shape = SHAPE_BOWL, .at = at};
        struct noisy_minimum m;
        assert_int_equal(noisy_minimum_search(&option, evaluate, &f, &m, NULL), STATUS_OK);
        assert_true(m.determined && fabs(m.u - at) < 0.03);
    }
}

/* Over many seeds at least 95 % of the minima lie inside two stated errors, less three standard deviations of a
 * binomial (200 x 0.95 - 3 x 3.1 = 180). Their mean is off by at most half of the stated error. */
static void check_errors(enum shape shape, double noise)
{
    enum { SEEDS = 200 };
    size_t n_inside = 0, n_point = 0;
    double sum_error = 0.0, sum_error2 = 0.0, sum_se2 = 0.0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        struct function f = {.shape = shape, .at = -0.3 + 0.6 * (double)seed / SEEDS, .noise = noise, .seed = seed};
        struct noisy_minimum m;
        assert_int_equal(noisy_minimum_search(&option, evaluate, &f, &m, NULL), STATUS_OK);
        assert_true(m.determined);
        n_inside += fabs(m.u - f.at) < 2.0 * m.u_se;
        n_point += m.n_point;
        sum_error += (m.u - f.at) / SEEDS;
        sum_error2 += (m.u - f.at) * (m.u - f.at) / SEEDS;
        sum_se2 += m.u_se * m.u_se / SEEDS;
    }
    print_message("inside two errors: %zu of %d; shift %+.4f, error %.4f, stated %.4f; %.1f points\n", n_inside, SEEDS,
                  sum_error, sqrt(sum_error2), sqrt(sum_se2), (double)n_point / SEEDS);
    assert_true(n_inside >= 180);
    assert_true(fabs(sum_error) < 0.5 * sqrt(sum_se2));
    assert_true(sqrt(sum_error2) < 0.1);
}

static void test_error_is_honest(void **unused)
{
    (void)unused;
    check_errors(SHAPE_BOWL, 0.03);
    check_errors(SHAPE_LOPSIDED, 0.01);
}

/* In a flat function the lowest noise may be reported as a determined minimum only as often as two standard errors of
 * the curvature allow: 2.3 % one-sided, and five times that because its position is free. */
static void test_flat_is_not_determined(void **unused)
{
    (void)unused;
    size_t n_fooled = 0;
    for (uint64_t seed = 1; seed <= 100; seed++) {
        struct function f = {.shape = SHAPE_FLAT, .noise = 0.03, .seed = seed};
        struct noisy_minimum m;
        assert_int_equal(noisy_minimum_search(&option, evaluate, &f, &m, NULL), STATUS_OK);
        n_fooled += m.determined;
    }
    print_message("flat functions with a reported minimum: %zu of 100\n", n_fooled);
    assert_true(n_fooled <= 12);
}

static void test_slope_ends_at_the_bound(void **unused)
{
    (void)unused;
    for (uint64_t seed = 1; seed <= 20; seed++) {
        struct function f = {.shape = SHAPE_SLOPE, .noise = 0.03, .seed = seed};
        struct noisy_minimum m;
        assert_int_equal(noisy_minimum_search(&option, evaluate, &f, &m, NULL), STATUS_OK);
        assert_true(m.at_bound && !m.determined && m.u < option.lower + 0.02);
    }
}

static void test_same_values_same_search(void **unused)
{
    (void)unused;
    struct function f = {.shape = SHAPE_BOWL, .at = 0.1, .noise = 0.05, .seed = 4}, g = f;
    struct noisy_minimum a, b;
    assert_int_equal(noisy_minimum_search(&option, evaluate, &f, &a, NULL), STATUS_OK);
    assert_int_equal(noisy_minimum_search(&option, evaluate, &g, &b, NULL), STATUS_OK);
    assert_memory_equal(&a, &b, sizeof a);
}

struct place_seen {
    size_t n;
    double farthest;
};

/* A bowl whose points have a large stated error. It notes how far from the middle it is asked after the first points.
 */
static status note_place(void *context, double u, double *y, double *se, struct error *err)
{
    const struct function bowl = {.shape = SHAPE_BOWL};
    struct place_seen *x = context;
    (void)err;
    if (x->n++ >= option.n_first) x->farthest = fmax(x->farthest, fabs(u));
    *y = value(&bowl, u);
    *se = 1.0;
    return STATUS_OK;
}

/* Noise asks for points far to the sides, where the function departs from a polynomial. They stay within 0.35 of the
 * range from the vertex, and a few steps of 0.01 that lead past points which have been evaluated. */
static void test_sides_stay_near(void **unused)
{
    (void)unused;
    struct place_seen seen = {0};
    struct noisy_minimum m;
    double range = option.upper - option.lower;
    assert_int_equal(noisy_minimum_search(&option, note_place, &seen, &m, NULL), STATUS_OK);
    assert_true(seen.n > option.n_first + 2);
    print_message("farthest side: %.3f of the range\n", seen.farthest / range);
    assert_true(seen.farthest > 0.33 * range && seen.farthest < 0.41 * range);
}

static void test_bad_input(void **unused)
{
    (void)unused;
    struct function f = {.shape = SHAPE_BOWL, .fail_at = 3};
    struct noisy_minimum m;
    struct error err;
    assert_int_equal(noisy_minimum_search(&option, evaluate, &f, &m, &err), STATUS_CANCELLED);
    struct noisy_minimum_option o = option;
    o.upper = o.lower;
    assert_int_equal(noisy_minimum_search(&o, evaluate, &f, &m, &err), STATUS_INVALID);
    f = (struct function){.shape = SHAPE_BOWL, .at = NAN};
    assert_int_equal(noisy_minimum_search(&option, evaluate, &f, &m, &err), STATUS_NUMERIC);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_without_noise),
        cmocka_unit_test(test_error_is_honest),
        cmocka_unit_test(test_flat_is_not_determined),
        cmocka_unit_test(test_slope_ends_at_the_bound),
        cmocka_unit_test(test_same_values_same_search),
        cmocka_unit_test(test_sides_stay_near),
        cmocka_unit_test(test_bad_input),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
