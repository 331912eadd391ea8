/* Facets of metal films: the closed form against the textbook's factors, energy from both sides, samples against their
 * density, reciprocity, derivatives against differences. */
#include "renderer/scattering/film_glint.h"

#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { N_PAIR = 2000, N_COS = 10, N_PHI = 12, N_BIN = N_COS * N_PHI, N_SAMPLE = 200000, N_FINE = 24 };

static void start(struct rng *rng, uint32_t stream)
{
    const struct rng_key key = {.seed = 52, .iteration = stream};
    rng_start(rng, &key, 0, 0);
}

/* A uniform direction; upper: on the side of v. */
static void direction(struct rng *rng, bool upper, float w[3])
{
    const double z = upper ? rng_double(rng) : 2 * rng_double(rng) - 1, phi = 2 * M_PI * rng_double(rng),
                 r = sqrt(1 - z * z);
    w[0] = (float)(r * cos(phi));
    w[1] = (float)z;
    w[2] = (float)(r * sin(phi));
}

/* f_r of channel c by its factors, after Walter et al. 2007 and Heitz 2014. */
static double by_factors(const struct film_material *m, int c, const float wi[3], const float wo[3])
{
    double h[3], length = 0, tan2[2];
    for (int a = 0; a < 3; a++) h[a] = (double)wi[a] + (double)wo[a];
    for (int a = 0; a < 3; a++) length += h[a] * h[a];
    for (int a = 0; a < 3; a++) h[a] /= sqrt(length);
    const double cos_i = (double)wi[1], cos_o = (double)wo[1], alpha2 = (double)m->roughness * (double)m->roughness,
                 cos2 = h[1] * h[1], t2 = (1 - cos2) / cos2,
                 d = alpha2 / (M_PI * cos2 * cos2 * (alpha2 + t2) * (alpha2 + t2));
    tan2[0] = (1 - cos_i * cos_i) / (cos_i * cos_i);
    tan2[1] = (1 - cos_o * cos_o) / (cos_o * cos_o);
    double lambda = 1, cos_d = 0;
    for (int k = 0; k < 2; k++) lambda += (sqrt(1 + alpha2 * tan2[k]) - 1) / 2;
    for (int a = 0; a < 3; a++) cos_d += h[a] * (double)wi[a];
    const double f = (double)m->color[c] + (1 - (double)m->color[c]) * pow(1 - cos_d, 5);
    return f * d / lambda / (4 * cos_i * cos_o);
}

static void test_closed_form(void **state)
{
    (void)state;
    struct rng rng;
    start(&rng, 1);
    for (int k = 0; k < N_PAIR; k++) {
        const struct film_material m = {.color = {0.9f, 0.6f, 0.3f}, .roughness = 0.05f + 0.7f * rng_float(&rng)};
        float wi[3], wo[3], f[3], back[3], below[2][3], g[3];
        direction(&rng, true, wi);
        direction(&rng, true, wo);
        if (wi[1] < 0.02f || wo[1] < 0.02f) continue;
        film_facets_eval(&m, wi, wo, f, NULL, NULL);
        film_facets_eval(&m, wo, wi, back, NULL, NULL);
        for (int a = 0; a < 3; a++) below[0][a] = a == 1 ? -wi[a] : wi[a], below[1][a] = a == 1 ? -wo[a] : wo[a];
        film_facets_eval(&m, below[0], below[1], g, NULL, NULL);
        for (int c = 0; c < 3; c++) {
            const double exact = by_factors(&m, c, wi, wo);
            /* single precision: q of D cancels by alpha^2, 400 at the least roughness */
            assert_true(fabs((double)f[c] / exact - 1) < 5e-4);
            assert_true(fabsf(f[c] - back[c]) <= 1e-5f * f[c]); /* reciprocal */
            assert_true(fabsf(f[c] - g[c]) <= 1e-6f * f[c]);    /* both sides alike */
        }
        film_facets_eval(&m, below[0], wo, g, NULL, NULL);
        assert_true(g[0] == 0 && g[1] == 0 && g[2] == 0); /* opaque */
    }
}

/* Light of a white furnace that leaves along wo, as samples see it. */
static double furnace(const struct film_material *m, const float wo[3], double *worst)
{
    double sum = 0;
    struct rng rng;
    start(&rng, 2);
    *worst = 0;
    for (int k = 0; k < N_SAMPLE / 10; k++) {
        float u[2], wi[3], f[3];
        for (int a = 0; a < 2; a++) u[a] = rng_float(&rng);
        film_facets_sample(m, wo, u, wi);
        const double pdf = (double)film_facets_eval(m, wi, wo, f, NULL, NULL),
                     weight = (double)f[0] * fabs((double)wi[1]) / pdf;
        assert_true(pdf > 0);
        sum += weight / (N_SAMPLE / 10);
        *worst = fmax(*worst, weight);
    }
    return sum;
}

static void test_furnace(void **state)
{
    (void)state;
    static const float roughness[] = {0.05f, 0.2f, 0.6f};
    for (int r = 0; r < 3; r++)
        for (int side = -1; side <= 1; side += 2)
            for (int deg = 0; deg <= 80; deg += 20) {
                const struct film_material m = {.color = {1, 1, 1}, .roughness = roughness[r]};
                const double theta = deg * M_PI / 180;
                const float wo[3] = {(float)(0.6 * sin(theta)), (float)(side * cos(theta)), (float)(0.8 * sin(theta))};
                double worst;
                const double light = furnace(&m, wo, &worst);
                assert_true(worst < 1 + 1e-4 && light < 1 + 1e-4); /* G / G1 is at most 1 */
                /* what facets hide of each other: largest at grazing and with roughness */
                if (deg <= 60) assert_true(light > 1 - 0.8 * (double)roughness[r]);
                assert_true(light > 0.4);
            }
}

static int bin_of(const float w[3])
{
    const int i = (int)fmin(N_COS - 1, 0.5 * (1 + (double)w[1]) * N_COS),
              j = (int)fmin(N_PHI - 1, (atan2((double)w[2], (double)w[0]) / (2 * M_PI) + 0.5) * N_PHI);
    return i * N_PHI + j;
}

/* The density of a bin of the sphere, by midpoints. g NULL: of the smooth film. */
static double expected(const struct film_material *m, const struct film_glint *g, const float wo[3], int bin)
{
    double sum = 0;
    for (int k = 0; k < N_FINE; k++)
        for (int l = 0; l < N_FINE; l++) {
            const double z = 2 * (bin / N_PHI + (k + 0.5) / N_FINE) / N_COS - 1,
                         phi = 2 * M_PI * ((bin % N_PHI + (l + 0.5) / N_FINE) / N_PHI - 0.5), r = sqrt(1 - z * z);
            const float wi[3] = {(float)(r * cos(phi)), (float)z, (float)(r * sin(phi))};
            float f[3];
            sum += (double)(g != NULL ? film_glint_eval(m, g, wi, wo, f) : film_facets_eval(m, wi, wo, f, NULL, NULL));
        }
    return sum * 4 * M_PI / N_BIN / (N_FINE * N_FINE);
}

/* Samples of a film, smooth (g NULL) or with glints, in bins of the sphere against the density, and the light of a
 * white furnace. unit_error: of midpoints. */
static void judge_samples(const struct film_material *m, const struct film_glint *g, const float view[3],
                          double unit_error)
{
    double count[N_BIN] = {0}, chi2 = 0, n_bin = 0, whole = 0, light = 0;
    float wo[3];
    struct rng rng;
    start(&rng, 3);
    const float length = sqrtf(view[0] * view[0] + view[1] * view[1] + view[2] * view[2]);
    for (int a = 0; a < 3; a++) wo[a] = view[a] / length;
    for (int k = 0; k < N_SAMPLE; k++) {
        float u[2], wi[3], f[3];
        if (g != NULL) {
            film_glint_sample(m, g, wo, &rng, wi);
        } else {
            for (int a = 0; a < 2; a++) u[a] = rng_float(&rng);
            film_facets_sample(m, wo, u, wi);
        }
        const float pdf = g != NULL ? film_glint_eval(m, g, wi, wo, f) : film_facets_eval(m, wi, wo, f, NULL, NULL);
        light += (double)f[0] * fabs((double)wi[1]) / (double)pdf / N_SAMPLE;
        count[bin_of(wi)]++;
    }
    for (int b = 0; b < N_BIN; b++) {
        const double share = expected(m, g, wo, b), n = N_SAMPLE * share;
        whole += share;
        if (n < 20) continue;
        chi2 += (count[b] - n) * (count[b] - n) / (n * (1 + n * unit_error * unit_error));
        n_bin++;
    }
    print_message("whole %.4f, chi2 %.1f of %g bins, light %.4f\n", whole, chi2, n_bin, light);
    assert_true(fabs(whole - 1) < 2e-3 + unit_error);
    assert_true(chi2 < n_bin + 5 * sqrt(2 * n_bin) && n_bin > 20); /* five standard deviations */
    assert_true(light > 0.65 && light < 1.05);                     /* a pixel's facets may lean towards wo */
}

static const float view[][3] = {{0.1f, 0.9f, 0.42f}, {0.7f, -0.3f, -0.65f}};

static void test_chi_square(void **state)
{
    (void)state;
    const struct film_material m = {.color = {0.9f, 0.9f, 0.9f}, .roughness = 0.35f};
    for (int v = 0; v < 2; v++) judge_samples(&m, NULL, view[v], 0);
}

/* Unresolved normals of .12 are wide enough for the bins' midpoints. */
static void test_chi_square_of_glints(void **state)
{
    (void)state;
    static const enum glint_kind kind[] = {GLINT_NOISE, GLINT_SCRATCHES, GLINT_FLAKES};
    const struct film_material m = {.color = {1, 1, 1}, .roughness = 0.2f};
    for (int k = 0; k < 3; k++) {
        const struct glint_option o = {
            .kind = kind[k], .seed = 4, .n_texel = 64, .texel_um = 1, .slope = 0.2f, .roughness = 0.12f};
        struct film_glint g = {0};
        struct glint_surface *surface = NULL;
        assert_int_equal(glint_surface_new(&o, &surface, NULL), STATUS_OK);
        g.surface = surface;
        film_glint_see(&g, (const float[2]){20, 30}, 3, view[0]);
        judge_samples(&m, &g, view[0], 0.01);
        glint_surface_free(surface);
    }
}

static void test_derivatives(void **state)
{
    (void)state;
    struct rng rng;
    start(&rng, 4);
    for (int k = 0; k < N_PAIR; k++) {
        const struct film_material m = {.color = {0.8f, 0.5f, 0.3f}, .roughness = 0.1f + 0.5f * rng_float(&rng)};
        struct film_material less = m, more = m;
        float wi[3], wo[3], f[3], low[3], high[3], by_color[3], by_alpha;
        const float step = 0.01f * m.roughness;
        direction(&rng, true, wi);
        direction(&rng, true, wo);
        if (wi[1] < 0.05f || wo[1] < 0.05f) continue;
        film_facets_eval(&m, wi, wo, f, by_color, &by_alpha);
        less.roughness -= step;
        more.roughness += step;
        film_facets_eval(&less, wi, wo, low, NULL, NULL);
        film_facets_eval(&more, wi, wo, high, NULL, NULL);
        const double alpha = (double)m.roughness, slope = log((double)high[0] / (double)low[0]) / (2 * (double)step);
        /* the third derivative is at most some 20 / alpha^3; rounding of ln f is 1e-6 */
        assert_true(fabs(slope - (double)by_alpha) < (20e-4 / 6 + 1e-6 / 0.02 + 2e-4) / alpha);
        for (int c = 0; c < 3; c++) {
            less = more = m;
            less.color[c] -= 0.01f;
            more.color[c] += 0.01f;
            film_facets_eval(&less, wi, wo, low, NULL, NULL);
            film_facets_eval(&more, wi, wo, high, NULL, NULL);
            const double by = log((double)high[c] / (double)low[c]) / 0.02;
            assert_true(fabs(by - (double)by_color[c]) < 2e-3 * (1 + by)); /* h^2 / (3 C^3) at C = .3 */
        }
    }
}

static void test_metals(void **state)
{
    (void)state;
    float color[3];
    for (size_t i = 0; film_metal_names[i] != NULL; i++) {
        assert_true(film_metal_color(film_metal_names[i], color));
        for (int c = 0; c < 3; c++) assert_true(color[c] > 0.2f && color[c] < 1);
    }
    assert_true(film_metal_color("gold", color) && color[0] > color[1] && color[1] > color[2]);
    assert_false(film_metal_color("tin foil", color));
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_closed_form), cmocka_unit_test(test_furnace),
                                      cmocka_unit_test(test_chi_square),  cmocka_unit_test(test_chi_square_of_glints),
                                      cmocka_unit_test(test_derivatives), cmocka_unit_test(test_metals)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
