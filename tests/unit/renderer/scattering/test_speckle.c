/* Speckle as a random factor: its distribution, mean and correlation over fibers, which Goodman 2007 states for fully
 * developed speckle, and what stays when light, camera and wavelength change. Limits follow from standard errors.
 */
#include "base/rng.h"
#include "renderer/scattering/models/wave/speckle_tables.h"
#include "renderer/scattering/scattering.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_FIBER = 20000, N_TABLE = 3 };

static const struct speckle_table *const tables[N_TABLE] = {&wave_silk_speckle, &wave_trilobal_speckle,
                                                            &wave_cotton_speckle};
static struct speckle_numbers numbers;

static int set_up(void **state)
{
    (void)state;
    speckle_numbers_init(&numbers);
    return 0;
}

static void unit(struct rng *rng, float d[3])
{
    const double z = 2 * rng_double(rng) - 1, phi = 2 * M_PI * rng_double(rng), r = sqrt(1 - z * z);
    d[0] = (float)z;
    d[1] = (float)(r * cos(phi));
    d[2] = (float)(r * sin(phi));
}

static struct rng random_numbers(uint32_t stream)
{
    const struct rng_key key = {77, 0, 0, 0};
    struct rng rng;
    rng_start(&rng, &key, stream, 0);
    return rng;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Mean 1, variance 1 (its standard error is sqrt(8 / n): the fourth central moment is 9), and the exponential
 * distribution itself by the test of Kolmogorov and Smirnov at 0.1 %. */
static void is_exponential(double *x, size_t n)
{
    double mean = 0, variance = 0, apart = 0;
    for (size_t i = 0; i < n; i++) mean += x[i] / (double)n;
    for (size_t i = 0; i < n; i++) variance += (x[i] - 1) * (x[i] - 1) / (double)n;
    assert_true(fabs(mean - 1) < 4 / sqrt((double)n));
    assert_true(fabs(variance - 1) < 4 * sqrt(8 / (double)n));
    qsort(x, n, sizeof *x, by_size);
    for (size_t i = 0; i < n; i++) {
        const double below = 1 - exp(-x[i]);
        apart = fmax(apart, fmax(below - (double)i / (double)n, (double)(i + 1) / (double)n - below));
    }
    assert_true(apart < 1.95 / sqrt((double)n));
}

/* At one pair of directions, over fibers: one band alone at several places of its lattice, and all bands of each table
 * in each channel. */
static void the_intensity_is_fully_developed(void **state)
{
    static double x[N_FIBER];
    struct rng rng = random_numbers(1);
    (void)state;
    for (int k = 0; k < 3; k++) {
        const struct speckle s = {.numbers = &numbers, .seed = 5};
        const float place[3] = {0.5f * (float)k, -0.37f * (float)k, 100.3f};
        for (uint32_t i = 0; i < N_FIBER; i++) {
            float a[2];
            speckle_amplitude(&s, i, (uint32_t)k, place, a);
            x[i] = (double)(a[0] * a[0] + a[1] * a[1]);
        }
        is_exponential(x, N_FIBER);
    }
    for (int t = 0; t < N_TABLE; t++)
        for (int c = 0; c < 3; c++) {
            const struct speckle s = {tables[t], &numbers, 9 + (uint64_t)c};
            float wi[3], wo[3], rgb[3];
            unit(&rng, wi);
            unit(&rng, wo);
            for (uint32_t i = 0; i < N_FIBER; i++) {
                speckle_factor(&s, i, wi, wo, rgb);
                x[i] = (double)rgb[c];
            }
            is_exponential(x, N_FIBER);
        }
}

/* Along the directions of one fiber, and of each seed, the mean is 1 as well: 32 fibers that are looked at in 4,096
 * pairs of directions. */
static void the_mean_over_directions_is_1(void **state)
{
    enum { N = 32, N_PAIR = 4096 };
    (void)state;
    for (int t = 0; t < N_TABLE; t++) {
        const struct speckle s = {tables[t], &numbers, 1};
        struct sample_mean all = {0};
        for (uint32_t i = 0; i < N; i++) {
            struct rng rng = random_numbers(100 + i);
            double mean = 0;
            for (int k = 0; k < N_PAIR; k++) {
                float wi[3], wo[3], rgb[3];
                unit(&rng, wi);
                unit(&rng, wo);
                speckle_factor(&s, i, wi, wo, rgb);
                mean += (double)rgb[1] / N_PAIR;
            }
            sample_mean_add(&all, mean);
        }
        assert_true(sample_mean_se(&all) < 0.05);
        assert_true(fabs(all.mean - 1) < 4 * sample_mean_se(&all));
    }
}

/* Pairs of directions across the fiber at random places, so far apart in wi + wo. */
static void the_correlation_is_that_of_the_weights(void **state)
{
    static const double distance[] = {0.05, 0.12, 0.3, 0.8};
    double last = 1;
    (void)state;
    for (int t = 0; t < N_TABLE; t++, last = 1)
        for (size_t k = 0; k < sizeof distance / sizeof *distance; k++) {
            const struct speckle s = {tables[t], &numbers, 3};
            const double want = speckle_correlation(tables[t]->weight, distance[k]);
            struct rng rng = random_numbers(3);
            struct sample_mean products = {0};
            for (uint32_t i = 0; i < N_FIBER; i++) {
                const double at = 2 * M_PI * rng_double(&rng), towards = 2 * M_PI * rng_double(&rng);
                float f[2][3];
                for (int e = 0; e < 2; e++) { /* speckle_factor takes any sum of the two vectors */
                    const double off = e * distance[k] / (double)tables[t]->cells[1];
                    const float to[3] = {0, (float)(cos(at) + off * cos(towards)),
                                         (float)(sin(at) + off * sin(towards))},
                                none[3] = {0};
                    speckle_factor(&s, i, to, none, f[e]);
                }
                sample_mean_add(&products, (double)((f[0][1] - 1) * (f[1][1] - 1)));
            }
            assert_true(fabs(products.mean - want) < 4 * sample_mean_se(&products));
            assert_true(want < last);
            last = want;
        }
}

/* Exchanging light and camera changes nothing; red has at a half vector what green has at one that is shorter by the
 * ratio of their wavelengths. */
static void the_pattern_stays_at_its_wave_vector(void **state)
{
    (void)state;
    for (int t = 0; t < N_TABLE; t++) {
        const struct speckle s = {tables[t], &numbers, 11};
        struct rng rng = random_numbers(4);
        for (uint32_t i = 0; i < 200; i++) {
            float wi[3], wo[3], f[3][3], shorter[3], none[3] = {0};
            unit(&rng, wi);
            unit(&rng, wo);
            speckle_factor(&s, i, wi, wo, f[0]);
            speckle_factor(&s, i, wo, wi, f[1]);
            assert_memory_equal(f[0], f[1], sizeof f[0]);
            for (int a = 0; a < 3; a++) shorter[a] = (wi[a] + wo[a]) * tables[t]->cells[0] / tables[t]->cells[1];
            speckle_factor(&s, i, shorter, none, f[2]);
            assert_true(fabsf(f[2][1] - f[0][0]) < 1e-3f * (1 + f[0][0]));
        }
    }
}

/* Fibers and seeds have patterns of their own: correlations of 20,000 independent pairs are 0 within 4 standard errors,
 * which the product of two exponential variables gives. */
static void fibers_and_seeds_are_independent(void **state)
{
    const struct speckle s[2] = {{&wave_silk_speckle, &numbers, 1}, {&wave_silk_speckle, &numbers, 2}};
    const float wi[3] = {0.3f, 0.9f, 0.316f}, wo[3] = {-0.2f, 0.1f, 0.975f};
    double fibers = 0, seeds = 0;
    (void)state;
    for (uint32_t i = 0; i < N_FIBER; i++) {
        float a[3], b[3], c[3];
        speckle_factor(&s[0], i, wi, wo, a);
        speckle_factor(&s[0], i + 1, wi, wo, b);
        speckle_factor(&s[1], i, wi, wo, c);
        fibers += (double)((a[0] - 1) * (b[0] - 1)) / N_FIBER;
        seeds += (double)((a[0] - 1) * (c[0] - 1)) / N_FIBER;
    }
    assert_true(fabs(fibers) < 4 / sqrt(N_FIBER) && fabs(seeds) < 4 / sqrt(N_FIBER));
}

static void tables_are_those_of_the_catalogue(void **state)
{
    (void)state;
    for (const struct scattering_model *const *m = scattering_registry(); *m != NULL; m++)
        assert_int_equal((*m)->speckle != NULL, model_catalogue_has_speckle((*m)->id));
    for (size_t i = 0; model_catalogue_with_speckle(i) != NULL; i++) {
        const struct scattering_model *m = scattering_find(model_catalogue_with_speckle(i));
        double sum = 0;
        assert_non_null(m);
        for (int b = 0; b < SPECKLE_N_BAND; b++) sum += pow((double)m->speckle->weight[b], 2);
        assert_true(fabs(sum - 1) < 1e-5);
        assert_true(m->speckle->cells[0] > 0 && m->speckle->cells[0] < m->speckle->cells[1] &&
                    m->speckle->cells[1] < m->speckle->cells[2]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_intensity_is_fully_developed),
        cmocka_unit_test(the_mean_over_directions_is_1),
        cmocka_unit_test(the_correlation_is_that_of_the_weights),
        cmocka_unit_test(the_pattern_stays_at_its_wave_vector),
        cmocka_unit_test(fibers_and_seeds_are_independent),
        cmocka_unit_test(tables_are_those_of_the_catalogue),
    };
    return cmocka_run_group_tests(tests, set_up, NULL);
}
