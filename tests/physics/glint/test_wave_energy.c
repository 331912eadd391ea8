/* Energy, reciprocity and samples of glints by wave optics. */
#include "base/rng.h"
#include "renderer/glint/wave_glint.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct wave_glint_option option_of(double rms_um, enum wave_model model)
{
    struct wave_glint_option o = wave_glint_option_usual();
    o.height.n = 256;
    o.height.rms_um = rms_um;
    o.coherence_um = 5;
    o.model = model;
    return o;
}

static struct wave_glint *glint_of(const struct wave_glint_option *o)
{
    struct wave_glint *g = NULL;
    struct error err = {0};
    if (wave_glint_new(o, &g, &err) != STATUS_OK) fail_msg("%s", err.text);
    return g;
}

static void unit(float d[3], double x, double y)
{
    d[0] = (float)x;
    d[1] = (float)y;
    d[2] = (float)sqrt(1 - x * x - y * y);
}

static struct rng random_numbers(uint32_t stream)
{
    const struct rng_key key = {91, 0, 0, 0};
    struct rng rng;
    rng_start(&rng, &key, stream, 0);
    return rng;
}

static bool sample(const struct wave_glint *g, struct wave_glint_query *q, struct rng *rng)
{
    float u[5];
    for (int i = 0; i < 5; i++) u[i] = rng_float(rng);
    return wave_glint_sample(g, q->center_um, q->wi, u, q->wo);
}

/* Energy by stationary phase: light goes where the slopes reflect it, with the weight of xi_1 and xi_3 of the model.
 * f_r = xi_1 lambda^2 |xi_2|^2 p(H') / xi_3^2 at psi = -xi_3 H', and the density of directions is that of slopes times
 * d slope / d wo. */
static double stationary_energy(const struct wave_glint_option *o, const float wi[3])
{
    struct wave_height h;
    struct error err = {0};
    double sum = 0;
    if (wave_height_init(&h, &o->height, &err) != STATUS_OK) fail_msg("%s", err.text);
    const bool is_fixed = o->model == WAVE_OHS || o->model == WAVE_R_OHS, is_old = o->model < WAVE_R_OHS;
    for (size_t i = 0; i < h.n * h.n; i++) {
        const double s[2] = {(double)h.slope_u[i], (double)h.slope_v[i]},
                     w[3] = {(double)wi[0], (double)wi[1], (double)wi[2]};
        double wo[3], per_slope, xi_3 = 2;
        if (is_fixed) {
            for (int k = 0; k < 2; k++) wo[k] = -2 * s[k] - w[k];
            wo[2] = sqrt(fmax(1 - wo[0] * wo[0] - wo[1] * wo[1], 0));
            per_slope = wo[2] / 4;
        } else {
            const double n2 = 1 + s[0] * s[0] + s[1] * s[1], d = 2 * (w[2] - s[0] * w[0] - s[1] * w[1]) / n2;
            for (int k = 0; k < 2; k++) wo[k] = -d * s[k] - w[k];
            wo[2] = d - w[2];
            xi_3 = w[2] + wo[2];
            per_slope = d * sqrt(n2) * d * sqrt(n2) / (2 * xi_3 * xi_3 * xi_3);
        }
        if (!(wo[2] > 0)) continue;
        const double z = w[2] + wo[2], xi_1 = is_old ? wo[2] / w[2] : z * z / (4 * w[2] * wo[2]);
        const double xi_2 = o->model == WAVE_KIRCHHOFF ? 1 + s[0] * s[0] + s[1] * s[1] : 1;
        sum += xi_1 * xi_2 * xi_2 / (xi_3 * xi_3) * wo[2] / per_slope / (double)(h.n * h.n);
    }
    wave_height_release(&h);
    return sum;
}

/* The reflected share of the light of a lossless surface, over places of the tile. */
static struct sample_mean reflected(const struct wave_glint *g, const float wi[3], uint32_t stream, int n)
{
    struct rng rng = random_numbers(stream);
    struct sample_mean mean = {0};
    for (int k = 0; k < n; k++) {
        struct wave_glint_query q = {{256 * rng_double(&rng), 256 * rng_double(&rng)}, {wi[0], wi[1], wi[2]}, {0}};
        const float um = 0.55F;
        float f = 0;
        if (!sample(g, &q, &rng)) {
            sample_mean_add(&mean, 0);
            continue;
        }
        wave_glint_value(g, &q, &um, 1, true, &f);
        sample_mean_add(&mean, (double)(f * q.wo[2] / wave_glint_pdf(g, &q)));
    }
    return mean;
}

/* Beyond stationary phase there are terms of the order of the wavelength over the correlation length times the slope,
 * which are allowed 1 %. Kirchhoff's model keeps all light at normal incidence, the reciprocal ones lose the square of
 * the slope. */
static void test_a_lossless_surface_keeps_its_light(void **state)
{
    (void)state;
    for (int m = 0; m < WAVE_N_MODEL; m++)
        for (int tilted = 0; tilted < 2; tilted++) {
            const struct wave_glint_option o = option_of(0.3, (enum wave_model)m);
            struct wave_glint *g = glint_of(&o);
            float wi[3];
            unit(wi, 0.5 * tilted, 0);
            const struct sample_mean mean = reflected(g, wi, (uint32_t)(2 * m + tilted), 20000);
            const double want = stationary_energy(&o, wi);
            print_message("%s %d: reflects %.4f +- %.4f, by its slopes %.4f\n", wave_model_name(o.model), tilted,
                          mean.mean, sample_mean_se(&mean), want);
            assert_true(fabs(mean.mean - want) < 4 * sample_mean_se(&mean) + 0.01);
            assert_true(mean.mean > 0.95 && mean.mean < 1.02 + 4 * sample_mean_se(&mean));
            wave_glint_free(g);
        }
}

static void test_nothing_comes_from_below(void **state)
{
    (void)state;
    const struct wave_glint_option o = option_of(0.3, WAVE_R_GHS);
    struct wave_glint *g = glint_of(&o);
    struct rng rng = random_numbers(50);
    for (int k = 0; k < 1000; k++) {
        struct wave_glint_query q = {{k, 2 * k}, {0}, {0}};
        const float um = 0.55F;
        float f, rgb[3];
        unit(q.wi, rng_double(&rng) - 0.5, rng_double(&rng) - 0.5);
        unit(q.wo, rng_double(&rng) - 0.5, rng_double(&rng) - 0.5);
        if (k % 2 == 0) q.wi[2] *= -1;
        if (k % 2 == 1 || k % 3 == 0) q.wo[2] *= -1;
        wave_glint_value(g, &q, &um, 1, true, &f);
        wave_glint_rgb(g, &q, METAL_GOLD, rgb);
        assert_true(f == 0 && rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0 && wave_glint_pdf(g, &q) == 0);
        if (k % 2 == 0) assert_false(sample(g, &q, &rng));
    }
    wave_glint_free(g);
}

/* The same sum of the same kernels: up to the rounding of floats. The first two are not reciprocal. */
static void test_three_models_are_reciprocal(void **state)
{
    (void)state;
    for (int m = 0; m < WAVE_N_MODEL; m++) {
        const struct wave_glint_option o = option_of(0.3, (enum wave_model)m);
        struct wave_glint *g = glint_of(&o);
        struct rng rng = random_numbers(60);
        double most = 0;
        for (int k = 0; k < 200; k++) {
            struct wave_glint_query q = {{k, 3 * k}, {0}, {0}};
            float rgb[3], back[3];
            unit(q.wi, 0.8 * rng_double(&rng), 0.4 * rng_double(&rng));
            if (!sample(g, &q, &rng)) continue;
            wave_glint_rgb(g, &q, METAL_SILVER, rgb);
            struct wave_glint_query turned = q;
            memcpy(turned.wi, q.wo, sizeof q.wo);
            memcpy(turned.wo, q.wi, sizeof q.wi);
            wave_glint_rgb(g, &turned, METAL_SILVER, back);
            for (int c = 0; c < 3; c++)
                most = fmax(most, fabs((double)(rgb[c] - back[c])) / (fabs((double)rgb[1]) + 0.1));
        }
        assert_int_equal(most < 1e-4, wave_model_is_reciprocal(o.model));
        wave_glint_free(g);
    }
}

enum { N_CELL = 24, N_NODE = 6, N_SAMPLE = 100000 };

/* Samples in cells of the unit disk of wo, against integrals of the density: dx dy = cos_o d omega. The last cell are
 * samples below the surface. */
static void test_samples_follow_their_density(void **state)
{
    (void)state;
    for (int m = 0; m < WAVE_N_MODEL; m += 3) { /* both ways to sample: ohs and r_ghs */
        struct wave_glint_option o = option_of(0.5, (enum wave_model)m);
        static double count[N_CELL * N_CELL + 1], expected[N_CELL * N_CELL + 1];
        struct wave_glint *g = glint_of(&o);
        struct rng rng = random_numbers(70 + (uint32_t)m);
        struct wave_glint_query q = {{33.3, 47.1}, {0}, {0}};
        double inside = 0, n_degree;
        memset(count, 0, sizeof count);
        unit(q.wi, 0.6, 0.2);
        const double low[2] = {-1, -0.6}, side = 0.8; /* the lobe about (-0.6, -0.2) */
        for (int k = 0; k < N_SAMPLE; k++) {
            const bool up = sample(g, &q, &rng);
            const double x = ((double)q.wo[0] - low[0]) / side * N_CELL, y = ((double)q.wo[1] - low[1]) / side * N_CELL;
            const bool in = up && x >= 0 && y >= 0 && x < N_CELL && y < N_CELL;
            count[in ? (size_t)y * N_CELL + (size_t)x : N_CELL * N_CELL]++;
        }
        for (size_t c = 0; c < N_CELL * N_CELL; c++) {
            expected[c] = 0;
            for (size_t k = 0; k < N_NODE * N_NODE; k++) {
                const double x =
                    low[0] + side / N_CELL * ((double)(c % N_CELL) + ((double)(k % N_NODE) + 0.5) / N_NODE);
                const double y =
                    low[1] + side / N_CELL * ((double)(c / N_CELL) + ((double)(k / N_NODE) + 0.5) / N_NODE);
                if (x * x + y * y >= 1) continue;
                unit(q.wo, x, y);
                expected[c] +=
                    N_SAMPLE * (double)(wave_glint_pdf(g, &q) / q.wo[2]) * pow(side / (N_CELL * (double)N_NODE), 2);
            }
            inside += expected[c];
        }
        expected[N_CELL * N_CELL] = N_SAMPLE - inside;
        const double x = chi_square_statistic(count, expected, N_CELL * N_CELL + 1, &n_degree);
        print_message("%s: chi-square %.1f at %.0f degrees of freedom, %.4f inside\n", wave_model_name(o.model), x,
                      n_degree, inside / N_SAMPLE);
        assert_true(inside / N_SAMPLE > 0.9 && inside / N_SAMPLE < 1);
        assert_true(chi_square_tail(x, n_degree) > 1e-4);
        wave_glint_free(g);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_lossless_surface_keeps_its_light),
        cmocka_unit_test(test_nothing_comes_from_below),
        cmocka_unit_test(test_three_models_are_reciprocal),
        cmocka_unit_test(test_samples_follow_their_density),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
