/* Distributions of the normals under a footprint: their integral, samples against densities, and a histogram of samples
 * of the map as the oracle. */
#include "base/rng.h"
#include "renderer/glint/glint_surface.h"
#include "tests/support/glint/glint_binning.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const struct glint_option kinds[] = {
    {.kind = GLINT_NOISE, .seed = 1, .n_texel = 128, .roughness = 0.01F},
    {.kind = GLINT_NOISE, .seed = 2, .n_texel = 128, .length_um = {200, 8}, .roughness = 0.01F, .step_texel = 0.5F},
    {.kind = GLINT_SCRATCHES, .seed = 3, .n_texel = 128, .roughness = 0.02F, .texel_um = 2},
    {.kind = GLINT_FLAKES, .seed = 4, .n_texel = 128, .roughness = 0.02F},
    {.kind = GLINT_NOISE, .seed = 5, .n_texel = 128, .roughness = 0.01F, .is_plain = true},
    {.kind = GLINT_FLAKES, .seed = 4, .n_texel = 64, .roughness = 0.01F, .slope = 0.25F},
};
enum { N_KIND = sizeof kinds / sizeof kinds[0] };

/* In texels: below an element, elongated, of some elements, beyond the period. */
static const struct glint_footprint places[] = {
    {{10.3F, 20.7F}, {0, 0, 0}},   {{127.9F, 0.2F}, {0.09F, 0.02F, 0.04F}},
    {{-3, 50}, {40, 39, 40}},      {{64, 64}, {9, -2, 4}},
    {{5, 500}, {0.1F, 0, 400}},    {{90, 30}, {100, 0, 100}},
    {{90, 30}, {1600, 300, 1300}}, {{1, 2}, {3000, 0, 3000}},
    {{1, 2}, {1e6F, 0, 1e6F}},     {{70, 9}, {40000, 0, 40}},
};
enum { N_PLACE = sizeof places / sizeof places[0] };

static struct glint_surface *surface_of(const struct glint_option *o)
{
    struct glint_surface *s = NULL;
    struct error err;
    assert_int_equal(glint_surface_new(o, &s, &err), STATUS_OK);
    return s;
}

static struct glint_footprint scaled(const struct glint_footprint *p, const struct glint_option *o)
{
    const float um = o->texel_um > 0 ? o->texel_um : 1;
    struct glint_footprint f = *p;
    for (int a = 0; a < 2; a++) f.center_um[a] *= um;
    for (int a = 0; a < 3; a++) f.covariance_um2[a] *= um * um;
    return f;
}

/* A sum over a lattice finer than the roughness is exact for Gaussians: exp(-2 pi^2) < 1e-8. What lies beyond
 * GLINT_REACH is 3e-4. Wide footprints are bilinear between nodes, and need a finer lattice. */
static void density_integrates_to_one(void **state)
{
    (void)state;
    for (int k = 0; k < N_KIND; k++) {
        struct glint_surface *s = surface_of(&kinds[k]);
        for (int p = 0; p < N_PLACE; p++) {
            const struct glint_footprint f = scaled(&places[p], &kinds[k]);
            const double step = (double)kinds[k].roughness / (p < 5 ? 1 : 2);
            const double edge = kinds[k].slope > 0.1F ? 0.95 : 0.45;
            double sum = 0;
            for (double t = -edge; t < edge; t += step)
                for (double u = -edge; u < edge; u += step) {
                    const float half[2] = {(float)u, (float)t};
                    sum += (double)glint_density(s, &f, half) * step * step;
                }
            print_message("kind %d place %d: integral %.5f\n", k, p, sum);
            assert_true(fabs(sum - 1) < 2e-3);
        }
        glint_surface_free(s);
    }
}

enum { N_BIN = 24, N_SUB = 7, N_SAMPLE = 20000 };

/* Counts samples in bins of [-0.4, 0.4]^2, and sums up the density in each by N_SUB x N_SUB places. */
static void samples_have_their_density(void **state)
{
    (void)state;
    static double count[N_BIN * N_BIN], expected[N_BIN * N_BIN];
    const double width = 0.8 / N_BIN;
    double least = 1;
    for (int k = 0; k < N_KIND; k++) {
        struct glint_surface *s = surface_of(&kinds[k]);
        for (int p = 0; p < N_PLACE; p++) {
            const struct glint_footprint f = scaled(&places[p], &kinds[k]);
            const struct rng_key key = {.seed = 77, .configuration = (uint32_t)(k * N_PLACE + p)};
            memset(count, 0, sizeof count);
            for (uint32_t i = 0; i < N_SAMPLE; i++) {
                float u[GLINT_N_NUMBER], half[2];
                struct rng r;
                rng_start(&r, &key, 0, i);
                for (int c = 0; c < GLINT_N_NUMBER; c++) u[c] = rng_float(&r);
                glint_sample(s, &f, u, half);
                const int x = (int)floor(((double)half[0] + 0.4) / width),
                          y = (int)floor(((double)half[1] + 0.4) / width);
                if (x >= 0 && y >= 0 && x < N_BIN && y < N_BIN) count[y * N_BIN + x]++;
            }
            for (int b = 0; b < N_BIN * N_BIN; b++) {
                expected[b] = 0;
                for (int i = 0; i < N_SUB * N_SUB; i++) {
                    const float half[2] = {(float)((b % N_BIN + (i % N_SUB + 0.5) / N_SUB) * width - 0.4),
                                           (float)((b / N_BIN + (i / N_SUB + 0.5) / N_SUB) * width - 0.4)};
                    expected[b] += (double)glint_pdf(s, &f, half) * width * width / (N_SUB * N_SUB) * N_SAMPLE;
                }
            }
            double degrees;
            const double x2 = chi_square_statistic(count, expected, N_BIN * N_BIN, &degrees),
                         tail = chi_square_tail(x2, degrees);
            print_message("kind %d place %d: chi^2 %.1f of %.0f, %.4f\n", k, p, x2, degrees, tail);
            least = fmin(least, tail);
        }
        glint_surface_free(s);
    }
    assert_true(least > 1e-4);
}

/* Half the sum of absolute differences between the histogram of the map's normals and the density's. It is 0 for equal
 * ones; the noise of n samples in the bins adds sqrt(2 / pi) / 2 times the sum of sqrt(share / n). */
static double distance_to_binning(const struct glint_option *o, const struct glint_footprint *f, double *noise)
{
    static double share[GLINT_BINNING_N * GLINT_BINNING_N];
    const double width = 2 * GLINT_BINNING_EDGE / GLINT_BINNING_N, n = 200000;
    struct glint_surface *s = surface_of(o);
    double sum = 0;
    glint_binning(o, f, (size_t)n, 5, share);
    *noise = 0;
    for (int b = 0; b < GLINT_BINNING_N * GLINT_BINNING_N; b++) {
        double mean = 0;
        for (int i = 0; i < 16; i++) {
            const float half[2] = {(float)((b % GLINT_BINNING_N + (i % 4 + 0.5) / 4) * width - GLINT_BINNING_EDGE),
                                   (float)((b / GLINT_BINNING_N + (i / 4 + 0.5) / 4) * width - GLINT_BINNING_EDGE)};
            mean += (double)glint_density(s, f, half) * width * width / 16;
        }
        sum += fabs(mean - share[b]) / 2;
        *noise += sqrt(2 / M_PI) / 2 * sqrt(mean / n);
    }
    glint_surface_free(s);
    return sum;
}

static void elements_match_a_histogram(void **state)
{
    (void)state;
    const struct glint_footprint some[] = {places[3], places[4], places[5], places[6], places[8]};
    for (int k = 0; k < N_KIND; k++)
        for (int p = 0; p < 5; p++) {
            const struct glint_footprint f = scaled(&some[p], &kinds[k]);
            double noise;
            const double d = distance_to_binning(&kinds[k], &f, &noise);
            print_message("kind %d place %d: distance %.4f, noise %.4f\n", k, p, d, noise);
            assert_true(d < noise + 0.03);
        }
}

/* Light of a round lamp, whose half vectors fill a disk of (s, t), three ways: samples of normals, samples of the lamp,
 * and both with the balance heuristic (000, figure 3.12). place: of the lamp's middle. Fills in means for one sample
 * each. */
static void lamp_estimates(const struct glint_surface *s, const struct glint_footprint *f, const float place[2],
                           float radius, struct sample_mean mean[3])
{
    const float lamp_pdf = 1 / ((float)M_PI * radius * radius);
    const struct rng_key key = {.seed = 12};
    struct rng r;
    rng_start(&r, &key, 0, 0);
    memset(mean, 0, 3 * sizeof *mean);
    for (int i = 0; i < 20000; i++) {
        float u[GLINT_N_NUMBER], normal[2], lamp[2];
        for (int c = 0; c < GLINT_N_NUMBER; c++) u[c] = rng_float(&r);
        glint_sample(s, f, u, normal);
        const float out = radius * sqrtf(rng_float(&r)), turn = 2 * (float)M_PI * rng_float(&r);
        lamp[0] = place[0] + out * cosf(turn);
        lamp[1] = place[1] + out * sinf(turn);
        const bool is_hit = hypotf(normal[0] - place[0], normal[1] - place[1]) < radius;
        const float at_normal = is_hit ? glint_pdf(s, f, normal) : 0, at_lamp = glint_density(s, f, lamp);
        sample_mean_add(&mean[0], is_hit ? 1 : 0);
        sample_mean_add(&mean[1], (double)(at_lamp / lamp_pdf));
        sample_mean_add(&mean[2],
                        (double)((is_hit ? at_normal / (at_normal + lamp_pdf) : 0) + at_lamp / (at_lamp + lamp_pdf)));
    }
}

static void samples_and_light_combine(void **state)
{
    (void)state;
    struct glint_surface *s = surface_of(&kinds[0]);
    const struct glint_footprint narrow = {{64, 64}, {0.01F, 0, 0.01F}}, wide = places[6];
    const struct {
        const struct glint_footprint *f;
        float radius;
    } lamps[] = {{&narrow, 0.15F}, {&wide, 0.01F}, {&wide, 0.1F}};
    for (int k = 0; k < 3; k++) {
        struct sample_mean mean[3];
        float place[2] = {0, 0};
        const float u[GLINT_N_NUMBER] = {0.5F, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F};
        glint_sample(s, lamps[k].f, u, place);
        lamp_estimates(s, lamps[k].f, place, lamps[k].radius, mean);
        const double se[3] = {sample_mean_se(&mean[0]), sample_mean_se(&mean[1]), sample_mean_se(&mean[2])};
        print_message("lamp %d: %.4f +- %.4f, %.4f +- %.4f, %.4f +- %.4f\n", k, mean[0].mean, se[0], mean[1].mean,
                      se[1], mean[2].mean, se[2]);
        for (int i = 0; i < 2; i++) assert_true(fabs(mean[i].mean - mean[2].mean) < 3.5 * hypot(se[i], se[2]) + 1e-3);
        /* nearly as good as the better of both, whose variance may be 0 */
        assert_true(se[2] < 1.2 * fmin(se[0], se[1]) + 0.05 * fmax(se[0], se[1]));
        assert_true(mean[2].mean > 0.005);
    }
    glint_surface_free(s);
}

static void faults_are_named(void **state)
{
    (void)state;
    const struct glint_option bad[] = {
        {.n_texel = 100},     {.texel_um = -1},      {.slope = 0.6F},
        {.roughness = 1e-4F}, {.length_um = {0, 1}}, {.flake_um = 1},
        {.step_texel = 0.7F}, {.scratch_share = 2},  {.kind = (enum glint_kind)9},
    };
    const char *const field[] = {"n_texel",  "texel_um",   "slope",         "roughness", "length_um",
                                 "flake_um", "step_texel", "scratch_share", "kind"};
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        struct glint_surface *s = NULL;
        struct error err = {0};
        assert_int_equal(glint_surface_new(&bad[k], &s, &err), STATUS_INVALID);
        assert_string_equal(err.field, field[k]);
        assert_null(s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(density_integrates_to_one),  cmocka_unit_test(samples_have_their_density),
        cmocka_unit_test(elements_match_a_histogram), cmocka_unit_test(samples_and_light_combine),
        cmocka_unit_test(faults_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
