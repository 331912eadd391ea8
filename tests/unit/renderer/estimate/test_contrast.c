/* The contrast of a crop from sums of paths: values and derivatives of a known crop come back, and the stated variances
 * are the scatter of repeated estimates. The paths are drawn from normal distributions, so that no scene is traced. */
#include "base/rng.h"
#include "renderer/estimate/contrast_blocks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

enum { SIDE = 2, CELLS = SIDE * SIDE, HALF = 40, REPEATS = 4000, N_VALUE = 6 };

/* Mean radiance and its derivative by one parameter of each cell and channel. */
static const double mean[CELLS][3] = {{1.0, 0.5, 2.0}, {1.4, 0.5, 1.0}, {0.8, 0.9, 1.5}, {1.2, 0.7, 1.1}};
static const double slope[CELLS][3] = {{0.3, 0.2, 0.5}, {0.1, 0.0, -0.4}, {0.5, 0.6, 0.1}, {-0.2, 0.1, 0.2}};
static const double noise = 0.3, shared_noise = 0.5;

static double square(double x) { return x * x; }

static void expected(size_t channel, double *contrast, double *derivative)
{
    double m = 0.0, d = 0.0, up = 0.0, up_slope = 0.0;
    for (size_t k = 0; k < CELLS; k++) {
        m += mean[k][channel] / CELLS;
        d += slope[k][channel] / CELLS;
    }
    for (size_t k = 0; k < CELLS; k++) {
        up += square(mean[k][channel] - m) / (CELLS - 1);
        up_slope += 2.0 * (mean[k][channel] - m) * (slope[k][channel] - d) / (CELLS - 1);
    }
    *contrast = up / square(m);
    *derivative = up_slope / square(m) - 2.0 * up * d / (m * m * m);
}

/* The sums of one set of paths of one cell, in the order of contrast_blocks.c: values, squares, products of a
 * derivative with its channel. Noise of a derivative is half that of its value and half its own. */
static void draw_set(size_t cell, struct rng *r, double *sum)
{
    for (size_t i = 0; i < 2 * N_VALUE + 3; i++) sum[i] = 0.0;
    for (size_t path = 0; path < HALF; path++)
        for (size_t channel = 0; channel < 3; channel++) {
            double z[2];
            rng_normal_pair(r, z);
            double value = mean[cell][channel] * (1.0 + noise * z[0]);
            double jac = slope[cell][channel] + shared_noise * (z[0] + z[1]);
            sum[channel] += value;
            sum[3 + channel] += jac;
            sum[N_VALUE + channel] += value * value;
            sum[N_VALUE + 3 + channel] += jac * jac;
            sum[2 * N_VALUE + channel] += jac * value;
        }
}

struct tally {
    double sum, squares, stated; /* of the estimates, and of their stated variances */
};

static void add(struct tally *t, double value, double variance)
{
    t->sum += value;
    t->squares += value * value;
    t->stated += variance;
}

/* The mean within four of its standard errors and a bias of the quotient that falls with the paths (contrast_blocks.h);
 * the variance within four standard errors of a variance. */
static void check(const char *name, const struct tally *t, double truth, double bias)
{
    double m = t->sum / REPEATS, var = t->squares / REPEATS - m * m;
    print_message("%s: %.5f, true %.5f +- %.5f; stated variance %.3f of the scatter\n", name, m, truth,
                  sqrt(var / REPEATS), t->stated / REPEATS / var);
    assert_true(fabs(m - truth) < 4.0 * sqrt(var / REPEATS) + bias);
    assert_true(fabs(t->stated / REPEATS / var - 1.0) < 4.0 * sqrt(2.0 / REPEATS));
}

static void test_known_crop(void **state)
{
    struct contrast_plan c;
    struct tally value[3] = {{0}}, jac[3] = {{0}};
    struct rng_key key = {.seed = 5};
    (void)state;
    assert_int_equal(contrast_plan_init(&c, SIDE, (size_t)CELLS * 2 * HALF, 3, NULL), STATUS_OK);
    assert_int_equal(c.n_half, HALF);
    for (uint32_t i = 0; i < REPEATS; i++) {
        struct estimate e;
        struct rng r;
        size_t bad;
        rng_start(&r, &key, i, 0);
        for (size_t set = 0; set < 2 * CELLS; set++) draw_set(set / 2, &r, c.sum + set * (2 * N_VALUE + 3));
        assert_true(contrast_reduce(&c, &e, &bad));
        assert_int_equal(e.n_path, CELLS * 2 * HALF);
        for (size_t channel = 0; channel < 3; channel++) {
            add(&value[channel], e.mean[channel], e.var[channel]);
            add(&jac[channel], e.jac[channel], e.jac_var[channel]);
        }
    }
    const double relative_variance = square(noise) / (CELLS * 2 * HALF);
    for (size_t channel = 0; channel < 3; channel++) {
        double contrast, derivative;
        expected(channel, &contrast, &derivative);
        check("contrast", &value[channel], contrast, 4.0 * relative_variance * contrast);
        check("derivative", &jac[channel], derivative, 8.0 * relative_variance * (fabs(derivative) + contrast));
    }
    contrast_plan_release(&c);
}

/* A black crop has no contrast and no weight; a value that is not a number is named. */
static void test_edges(void **state)
{
    struct contrast_plan c;
    struct estimate e;
    size_t bad = 99;
    (void)state;
    assert_int_equal(contrast_plan_init(&c, SIDE, 1, 3, NULL), STATUS_OK);
    assert_int_equal(c.n_half, 2); /* four paths a cell at least */
    assert_true(contrast_reduce(&c, &e, &bad));
    for (size_t channel = 0; channel < 3; channel++) assert_true(e.mean[channel] == 0.0 && e.var[channel] == 1.0);
    c.sum[4] = NAN;
    assert_false(contrast_reduce(&c, &e, &bad));
    assert_int_equal(bad, 4);
    contrast_plan_release(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_known_crop), cmocka_unit_test(test_edges)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
