/* Noise of paths taken off a table of deep light: tables of low rank with noise that is known, and tables of noise. */
#include "base/rng.h"
#include "renderer/fast/precompute/deep_rank.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N = 40, N_COLUMN = 3 * N, N_ALL = N * N_COLUMN, RANK = 3 };

static struct {
    double area[N], truth[N_ALL], half[2][N_ALL], value[N_ALL];
} t;

/* Smooth functions of view and light, of the given rank beside their means. Standard deviations of both halves are sd
 * over the roots of both areas, as those of paths are that are counted at nodes. */
static void make(size_t rank, double sd, uint32_t seed)
{
    struct rng rng;
    double normal[2];
    rng_start(&rng, &(struct rng_key){.seed = 17}, seed, 0);
    for (size_t i = 0; i < N; i++) t.area[i] = 0.02 + 0.06 * rng_double(&rng);
    t.area[N - 1] = 0; /* a corner of the square around the disk */
    for (size_t i = 0; i < N_ALL; i++) {
        double view = (double)(i / N_COLUMN) / N, light = (double)(i % N_COLUMN / 3) / N, channel = (double)(i % 3);
        t.truth[i] = 1 + 0.5 * view + 0.3 * light * (1 + channel);
        for (size_t k = 1; k <= rank; k++)
            t.truth[i] += 0.6 / (double)k * cos(3.0 * (double)k * view) * cos(2.0 * (double)k * light + channel);
        double scale = sqrt(t.area[i / N_COLUMN] * t.area[i % N_COLUMN / 3]);
        rng_normal_pair(&rng, normal);
        for (int h = 0; h < 2; h++) t.half[h][i] = scale > 0 ? t.truth[i] + sd / scale * normal[h] : 0;
    }
}

/* What is kept; sums of areas times squares of errors, of the value and of the mean of both halves. */
static struct deep_rank_fit keep(double *error2, double *error2_of_mean)
{
    const struct deep_halves halves = {{t.half[0], t.half[1]}, t.area, t.area, N, N};
    struct deep_rank_fit fit;
    assert_int_equal(deep_rank_keep(&halves, NULL, t.value, &fit, NULL), STATUS_OK);
    *error2 = *error2_of_mean = 0;
    for (size_t i = 0; i < N_ALL; i++) {
        double area = t.area[i / N_COLUMN] * t.area[i % N_COLUMN / 3], mean = 0.5 * (t.half[0][i] + t.half[1][i]);
        *error2 += area * (t.value[i] - t.truth[i]) * (t.value[i] - t.truth[i]);
        *error2_of_mean += area * (mean - t.truth[i]) * (mean - t.truth[i]);
    }
    return fit;
}

/* Of N_ALL numbers with noise of one variance, as many have it in the result as it has free numbers: the means over
 * views and lights, and the singular vectors. */
static void low_rank_is_recovered(void **state)
{
    (void)state;
    double error2, of_mean;
    const double n = N - 1, free_numbers = 6 * n - 3 + RANK * (4 * n - RANK - 4), share = free_numbers / (3 * n * n);
    make(RANK, 0.004, 0);
    const struct deep_rank_fit fit = keep(&error2, &of_mean);
    print_message(
        "rank %zu, factor of the rest %.3f; error2 over that of the mean %.4f, expected %.4f; noise as stated "
        "%.4f of the error\n",
        fit.rank, fit.of_rest, error2 / of_mean, share, fit.noise2 / error2);
    /* means of 4,500 and of free_numbers squares of noise: 4 standard errors, and the second order of the vectors */
    assert_int_equal(fit.rank, RANK);
    assert_true(fabs(error2 / of_mean - share) < 4 * share * sqrt(2 / free_numbers + 2 / (3 * n * n)) + share * share);
    assert_true(fabs(fit.noise2 / error2 - 1) < 4 * sqrt(4 / free_numbers) + share);
}

/* A table that is the sum of functions of view and of light alone: its noise has no rank that both halves share. */
static void noise_has_no_rank(void **state)
{
    (void)state;
    double error2, of_mean;
    size_t kept = 0;
    for (uint32_t seed = 1; seed <= 5; seed++) {
        make(0, 0.004, seed);
        kept += keep(&error2, &of_mean).rank;
        assert_true(error2 < 0.2 * of_mean);
    }
    print_message("singular values of noise that were kept in 5 tables: %zu\n", kept);
    assert_true(kept <= 5);
}

/* Integrals over lights of each view, and over views of each light, are those of the halves' mean. */
static void energy_is_kept(void **state)
{
    (void)state;
    double error2, of_mean, off[2][N_COLUMN] = {{0}}, whole[2][N_COLUMN] = {{0}};
    make(RANK, 0.02, 9);
    keep(&error2, &of_mean);
    for (size_t i = 0; i < N_ALL; i++) {
        double mean = 0.5 * (t.half[0][i] + t.half[1][i]);
        const size_t at[2] = {3 * (i / N_COLUMN) + i % 3, i % N_COLUMN};
        const double area[2] = {t.area[i % N_COLUMN / 3], t.area[i / N_COLUMN]};
        for (int k = 0; k < 2; k++) {
            off[k][at[k]] += area[k] * (t.value[i] - mean);
            whole[k][at[k]] += area[k] * mean;
        }
    }
    for (int k = 0; k < 2; k++)
        for (size_t i = 0; i < N_COLUMN - 3; i++) assert_true(fabs(off[k][i]) < 1e-5 * fabs(whole[k][i]));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(low_rank_is_recovered), cmocka_unit_test(noise_has_no_rank),
                                       cmocka_unit_test(energy_is_kept)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
