/* Tables over the unit square against sums over a fine grid: their values, integrals and warps, and the weights of the
 * directions of the light. */
#include "base/rng.h"
#include "optimizer/photographs/rows/brdf_warp.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 5, HEIGHT = 4, N_PHI = 3, N_THETA = 2, SLICES = N_PHI * N_THETA, STEPS = 240 };

static float value[SLICES * HEIGHT * WIDTH];
static double phi[N_PHI] = {-1.0, 0.0, 3.0}, theta[N_THETA] = {0.25, 1.25};
static const struct warp_axes axes = {N_PHI, N_THETA, phi, theta};

static struct warp_table make(void)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 4}, 0, 0);
    for (size_t i = 0; i < sizeof value / sizeof *value; i++) value[i] = (float)(0.1 + rng_double(&rng));
    return (struct warp_table){WIDTH, HEIGHT, SLICES, value};
}

static void assert_near(double got, double want)
{
    if (!(fabs(got - want) < 1e-6)) fail_msg("%.9g, not %.9g", got, want);
}

/* Trapezoidal sum, which is exact: steps end where cells do, and the functions are linear in each cell. */
static double along_x(const struct warp_table *t, const struct warp_mix *mix, double to, double y)
{
    double sum = 0.0;
    const int n = (int)lround(to * STEPS);
    for (int i = 0; i < n; i++)
        for (int end = 0; end < 2; end++)
            sum += 0.5 / STEPS * warp_table_value(t, mix, (double[2]){(double)(i + end) / STEPS, y});
    return sum;
}

static double up_y(const struct warp_table *t, const struct warp_mix *mix, double to)
{
    double sum = 0.0;
    const int n = (int)lround(to * STEPS);
    for (int i = 0; i < n; i++)
        for (int end = 0; end < 2; end++) sum += 0.5 / STEPS * along_x(t, mix, 1.0, (double)(i + end) / STEPS);
    return sum;
}

static void test_values(void **state)
{
    (void)state;
    struct warp_table t = make();
    for (size_t y = 0; y < HEIGHT; y++)
        for (size_t x = 0; x < WIDTH; x++) {
            const double u[2] = {(double)x / (WIDTH - 1), (double)y / (HEIGHT - 1)};
            assert_near(warp_table_value(&t, NULL, u), (double)value[y * WIDTH + x]);
        }
    const double middle[2] = {1.5 / (WIDTH - 1), 2.25 / (HEIGHT - 1)}, beyond[2] = {-1.0, 2.0};
    const float *row = value + 2 * WIDTH;
    assert_near(warp_table_value(&t, NULL, middle),
                0.375 * ((double)row[1] + (double)row[2]) + 0.125 * ((double)row[WIDTH + 1] + (double)row[WIDTH + 2]));
    assert_near(warp_table_value(&t, NULL, beyond), (double)value[(HEIGHT - 1) * WIDTH]);
}

static void test_directions_of_the_light(void **state)
{
    (void)state;
    static const struct {
        double phi, theta, weight[SLICES];
    } check[] = {
        {-1.0, 0.25, {1, 0, 0, 0, 0, 0}},
        {0.0, 1.25, {0, 0, 0, 1, 0, 0}},
        {3.0, 1.25, {0, 0, 0, 0, 0, 1}},
        {-0.75, 0.5, {0.5625, 0.1875, 0.1875, 0.0625, 0, 0}},
        {1.5, 0.75, {0, 0, 0.25, 0.25, 0.25, 0.25}},
        {-9.0, -9.0, {1, 0, 0, 0, 0, 0}},
        {9.0, 9.0, {0, 0, 0, 0, 0, 1}},
    };
    struct warp_table t = make();
    for (size_t i = 0; i < sizeof check / sizeof *check; i++) {
        struct warp_mix mix;
        double got[SLICES] = {0}, want_value = 0.0;
        warp_mix_at(&axes, check[i].phi, check[i].theta, &mix);
        for (size_t k = 0; k < 4; k++) {
            assert_true(mix.slice[k] < SLICES);
            got[mix.slice[k]] += mix.weight[k];
        }
        for (size_t s = 0; s < SLICES; s++) {
            assert_near(got[s], check[i].weight[s]);
            want_value += check[i].weight[s] * (double)value[s * HEIGHT * WIDTH + WIDTH + 1];
        }
        assert_near(warp_table_value(&t, &mix, (double[2]){1.0 / (WIDTH - 1), 1.0 / (HEIGHT - 1)}), want_value);
    }
}

static void test_integrals(void **state)
{
    (void)state;
    struct warp_table t = make();
    memset(value + HEIGHT * WIDTH, 0, HEIGHT * WIDTH * sizeof *value); /* a slice of nothing */
    warp_table_normalize(&t);
    for (size_t s = 0; s < SLICES; s++) {
        const struct warp_mix mix = {.slice = {s, s, s, s}, .weight = {1.0, 0.0, 0.0, 0.0}};
        assert_near(up_y(&t, &mix, 1.0), 1.0);
        if (s == 1) assert_true(value[s * HEIGHT * WIDTH + 7] == 1.0f);
    }
}

static void test_warps(void **state)
{
    (void)state;
    struct warp_table t = make();
    struct warp_mix mix;
    double out[2];
    warp_mix_at(&axes, 0.3, 0.6, &mix);
    for (int i = 0; i <= 12; i++)
        for (int k = 0; k <= 12; k++) {
            const double u[2] = {i / 12.0, k / 12.0};
            warp_table_invert(&t, &mix, u, out);
            assert_near(out[0], along_x(&t, &mix, u[0], u[1]) / along_x(&t, &mix, 1.0, u[1]));
            assert_near(out[1], up_y(&t, &mix, u[1]) / up_y(&t, &mix, 1.0));
        }
    memset(value, 0, sizeof value);
    warp_table_invert(&t, &mix, (double[2]){0.3, 0.8}, out);
    assert_true(out[0] == 0.3 && out[1] == 0.8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_values), cmocka_unit_test(test_directions_of_the_light),
                                       cmocka_unit_test(test_integrals), cmocka_unit_test(test_warps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
