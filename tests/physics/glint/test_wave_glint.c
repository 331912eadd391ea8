/* Reflectance by Gabor kernels against diffraction by its definition (tests/support/glint/wave_oracle.h), closed forms
 * of a mirror, and the mean over a random surface, which is known. */
#include "base/rng.h"
#include "renderer/glint/wave_glint.h"
#include "tests/support/glint/wave_oracle.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_TEXEL = 128, FINE = 8 };

static struct wave_glint_option small_option(double rms_um, double length_um)
{
    struct wave_glint_option o = wave_glint_option_usual();
    o.height.n = N_TEXEL;
    o.height.rms_um = rms_um;
    o.height.length_um[0] = o.height.length_um[1] = length_um;
    return o;
}

static struct wave_glint *glint_of(const struct wave_glint_option *o)
{
    struct wave_glint *g = NULL;
    struct error err = {0};
    if (wave_glint_new(o, &g, &err) != STATUS_OK) fail_msg("%s", err.text);
    return g;
}

static struct wave_oracle oracle_of(const struct wave_glint_option *o)
{
    struct wave_oracle oracle;
    struct wave_height h;
    struct error err = {0};
    if (wave_height_init(&h, &o->height, &err) != STATUS_OK) fail_msg("%s", err.text);
    wave_oracle_init(&oracle, &h, FINE);
    wave_height_release(&h);
    return oracle;
}

static double area_of(double sd) { return M_PI * sd * sd * (1 - exp(-9)); }

static void unit(float d[3], double x, double y)
{
    d[0] = (float)x;
    d[1] = (float)y;
    d[2] = (float)sqrt(1 - x * x - y * y);
}

/* Sums over a lobe, from which mean ratio and correlation follow. */
struct comparison {
    double n, got, want, got2, want2, both;
};

static void compare(struct comparison *c, double got, double want)
{
    c->n += 1;
    c->got += got;
    c->want += want;
    c->got2 += got * got;
    c->want2 += want * want;
    c->both += got * want;
}

static double correlation(const struct comparison *c)
{
    return (c->both - c->got * c->want / c->n) /
           sqrt((c->got2 - c->got * c->got / c->n) * (c->want2 - c->want * c->want / c->n));
}

static const double place_um[2] = {40.3, 97.9}; /* its window crosses the edge of the tile */

/* The lobe of nearly perpendicular light, where psi runs over the grid of the Fourier transform. */
static struct comparison lobe(const struct wave_glint_option *o, float wavelength_um)
{
    struct wave_glint *g = glint_of(o);
    struct wave_oracle oracle = oracle_of(o);
    const struct wave_oracle_window w = {{place_um[0], place_um[1]}, o->coherence_um};
    double *power = malloc(oracle.n * oracle.n * sizeof *power);
    struct comparison c = {0};
    struct wave_glint_query q = {{place_um[0], place_um[1]}, {0}, {0}};
    assert_non_null(power);
    wave_oracle_lobe(&oracle, &w, 2, (double)wavelength_um, power);
    unit(q.wi, 0.05, 0.02);
    const double step = (double)wavelength_um / N_TEXEL;
    const int most = (int)(0.8 / step);
    for (int j = -most; j <= most; j += 3)
        for (int i = -most; i <= most; i += 3) {
            float f;
            if (hypot(i, j) > most) continue;
            unit(q.wo, i * step - 0.05, j * step - 0.02);
            wave_glint_value(g, &q, &wavelength_um, 1, true, &f);
            const size_t at =
                (size_t)(j + (int)oracle.n) % oracle.n * oracle.n + (size_t)(i + (int)oracle.n) % oracle.n;
            const double xi_1 = (double)(q.wo[2] / q.wi[2]) / pow((double)wavelength_um, 2);
            compare(&c, (double)f, xi_1 / area_of(o->coherence_um) * power[at]);
        }
    free(power);
    wave_oracle_release(&oracle);
    wave_glint_free(g);
    return c;
}

/* Curved kernels leave the third order of the phase: V is its variance (wave_height_rest) at 0.5 um, and the mean is
 * corrected by V / 2. Bumps of 8 um have kernels of 2 um, V = 0.04 and 0.07 at 0.39 um, so V^2 = 0.005 of the mean is
 * left. Bumps of 6.5 um have kernels of 1 um and V = 0.002. As published kernels are flat: they lose half of the square
 * of x = 2 pi xi_3 sigma^2 kappa / lambda for each axis, 0.12 at 8 um. */
static void test_lobes_are_those_of_the_whole_patch(void **state)
{
    (void)state;
    const float um[] = {0.389375F, 0.5F, 0.800625F};
    for (size_t i = 0; i < 2 * (sizeof um / sizeof *um); i++) {
        const bool is_fine = i % 2 != 0;
        struct wave_glint_option o = small_option(0.35, is_fine ? 6.5 : 8);
        o.model = WAVE_OHS;
        const struct comparison ours = lobe(&o, um[i / 2]);
        o.is_published = true;
        const struct comparison published = lobe(&o, um[i / 2]);
        print_message("%.3f um: mean %.5f, correlation %.6f; as published %.5f, %.6f\n", (double)um[i / 2],
                      ours.got / ours.want, correlation(&ours), published.got / published.want,
                      correlation(&published));
        assert_true(fabs(ours.got / ours.want - 1) < (is_fine ? 0.002 : 0.005));
        assert_true(correlation(&ours) > (is_fine ? 0.9998 : 0.996));
        assert_true(correlation(&ours) > correlation(&published));
        assert_true(fabs(published.got / published.want - 1) < (is_fine ? 0.12 : 0.04));
        assert_true(fabs(published.got / published.want - 1) > fabs(ours.got / ours.want - 1));
        assert_true(correlation(&published) > (is_fine ? 0.97 : 0.99));
    }
}

/* Smooth and steep surfaces, of which the first has kernels of 4 um; brushed ones; scratches. */
static void test_other_surfaces(void **state)
{
    (void)state;
    struct wave_glint_option o[4] = {small_option(0.5, 20), small_option(0.5, 5), small_option(0.3, 5),
                                     small_option(0, 8)};
    o[2].height.length_um[1] = 60;
    o[3].height.n_scratch = 12;
    o[3].height.scratch_depth_um = 0.3;
    o[3].height.scratch_width_um = 2.5;
    for (int i = 0; i < 4; i++) {
        o[i].model = WAVE_R_OHS;
        o[i].height.seed = 7;
        struct wave_glint_option asked = o[i];
        asked.model = WAVE_OHS;
        const struct comparison c = lobe(&asked, 0.5F);
        print_message("surface %d: mean %.5f, correlation %.6f\n", i, c.got / c.want, correlation(&c));
        assert_true(fabs(c.got / c.want - 1) < 0.02); /* the limits of the published comparison */
        assert_true(correlation(&c) > 0.99);
    }
}

static void random_pair(struct rng *rng, struct wave_glint_query *q)
{
    const double turn = 2 * M_PI * rng_double(rng), tilt = 0.7 * rng_double(rng);
    unit(q->wi, tilt * cos(turn), tilt * sin(turn));
    unit(q->wo, -(double)q->wi[0] + 0.15 * (2 * rng_double(rng) - 1),
         -(double)q->wi[1] + 0.15 * (2 * rng_double(rng) - 1));
}

/* All models at oblique directions, each by its own factors from the table of the source. */
static void test_models_are_their_integrals(void **state)
{
    (void)state;
    const float um = 0.55F;
    struct wave_glint_option o = small_option(0.35, 6.5);
    struct wave_oracle oracle = oracle_of(&o);
    for (int m = 0; m < WAVE_N_MODEL; m++) {
        const struct rng_key key = {5, 0, 0, 0};
        struct rng rng;
        struct comparison c = {0};
        double worst = 0;
        o.model = (enum wave_model)m;
        struct wave_glint *g = glint_of(&o);
        rng_start(&rng, &key, 0, 0);
        for (int k = 0; k < 40; k++) {
            struct wave_glint_query q = {{60 + k, 30}, {0}, {0}};
            float f;
            random_pair(&rng, &q);
            const struct wave_oracle_window w = {{60 + k, 30}, o.coherence_um};
            const double psi[3] = {(double)(q.wi[0] + q.wo[0]), (double)(q.wi[1] + q.wo[1]),
                                   (double)(q.wi[2] + q.wo[2])};
            const bool is_old = m == WAVE_OHS || m == WAVE_GHS, is_fixed = m == WAVE_OHS || m == WAVE_R_OHS;
            const double xi_1 =
                is_old ? (double)(q.wo[2] / q.wi[2]) : psi[2] * psi[2] / (4 * (double)q.wi[2] * (double)q.wo[2]);
            const double want =
                xi_1 / (0.55 * 0.55 * area_of(10)) *
                wave_oracle_sum(&oracle, &w, is_fixed ? 2 : psi[2], psi, m == WAVE_KIRCHHOFF ? 1 / psi[2] : 0, 0.55);
            wave_glint_value(g, &q, &um, 1, true, &f);
            compare(&c, (double)f, want);
            worst = fmax(worst, fabs((double)f - want));
        }
        print_message("%s: mean %.5f, correlation %.6f, worst %.4f of the mean\n", wave_model_name((enum wave_model)m),
                      c.got / c.want, correlation(&c), worst * c.n / c.want);
        assert_true(worst < 0.03 * c.want / c.n);
        wave_glint_free(g);
    }
    wave_oracle_release(&oracle);
}

/* The Fourier transform of the window by quadrature over r. */
static double window_transform(double sd, double v)
{
    enum { N = 4000 };
    double sum = 0;
    for (int i = 0; i < N; i++) {
        const double r = 3 * sd * (i + 0.5) / N;
        sum += exp(-r * r / (2 * sd * sd)) * j0(2 * M_PI * v * r) * r * 3 * sd / N;
    }
    return 2 * M_PI * sum;
}

static void test_a_mirror_has_the_lobe_of_its_window(void **state)
{
    (void)state;
    struct wave_glint_option o = small_option(0, 8);
    struct wave_glint *g = glint_of(&o);
    struct wave_glint_query q = {{17, 23}, {0}, {0}};
    const float um = 0.5F;
    double peak = 0;
    unit(q.wi, 0.4, 0.1);
    for (int i = 0; i <= 20; i++) {
        const double psi = 0.002 * i;
        float f;
        unit(q.wo, psi - 0.4, -0.1);
        wave_glint_value(g, &q, &um, 1, true, &f);
        const double z = (double)(q.wi[2] + q.wo[2]);
        const double want = z * z / (4 * (double)q.wi[2] * (double)q.wo[2]) / (0.25 * area_of(10)) *
                            pow(window_transform(10, psi / 0.5), 2);
        if (i == 0) peak = want;
        /* the disc of kernels has an edge of texels, whose weight is 0.011, and the window is smaller by sigma^2 */
        assert_true(fabs((double)f - want) < 2e-3 * peak);
    }
    wave_glint_free(g);
}

/* Dropped kernels are below exp(-4.5) each, and random in phase. */
static void test_pruning_changes_little(void **state)
{
    (void)state;
    struct wave_glint_option o = small_option(0.5, 5);
    struct wave_glint *g = glint_of(&o);
    float um[WAVE_N_COLOR], weight[WAVE_N_COLOR][3];
    double mean[WAVE_N_COLOR] = {0}, off[WAVE_N_COLOR] = {0};
    size_t kept = 0, all = 0;
    wave_glint_colors(um, weight);
    for (int k = 0; k < 1000; k++) {
        struct wave_glint_query q = {{50, 70}, {0, 0, 1}, {0}};
        const int rows = k / 32;
        float f[WAVE_N_COLOR], whole[WAVE_N_COLOR];
        unit(q.wo, 0.9 * (k % 32 - 16) / 23, 0.9 * (rows - 16) / 23);
        kept += wave_glint_value(g, &q, um, WAVE_N_COLOR, true, f);
        all += wave_glint_value(g, &q, um, WAVE_N_COLOR, false, whole);
        for (int i = 0; i < WAVE_N_COLOR; i++) {
            mean[i] += (double)whole[i] / 1000;
            off[i] += pow((double)(f[i] - whole[i]), 2) / 1000;
        }
    }
    for (int i = 0; i < WAVE_N_COLOR; i++) {
        print_message("%.3f um: root mean square of the difference %.5f of the mean\n", (double)um[i],
                      sqrt(off[i]) / mean[i]);
        assert_true(sqrt(off[i]) < 0.01 * mean[i]);
    }
    print_message("kept %zu of %zu\n", kept, all);
    assert_true(kept < all);
    wave_glint_free(g);
}

/* Mean over places of a Gaussian surface (Beckmann and Spizzichino 1963): with g = 2 pi xi_3 rms / lambda
 * E |..|^2 / A_c = 2 pi integral of exp(-t^2 / (4 sd^2)) exp(-g^2 (1 - exp(-t^2 / L^2))) J0(2 pi |psi| t / lambda) t dt
 */
static double expected_lobe(double rms, double length, double sd, double psi, double um)
{
    enum { N = 20000 };
    const double g2 = pow(2 * M_PI * 2 * rms / um, 2), most = 8 * sd;
    double sum = 0;
    for (int i = 0; i < N; i++) {
        const double t = most * (i + 0.5) / N;
        sum +=
            exp(-t * t / (4 * sd * sd) - g2 * (1 - exp(-t * t / (length * length)))) * j0(2 * M_PI * psi * t / um) * t;
    }
    return 2 * M_PI * sum * most / N;
}

static void test_the_mean_over_places_is_known(void **state)
{
    (void)state;
    enum { N_PLACE = 1500 };
    struct wave_glint_option o = small_option(0.2, 6);
    o.height.n = 1024;
    o.coherence_um = 6;
    o.model = WAVE_OHS;
    struct wave_glint *g = glint_of(&o);
    const float um = 0.55F;
    for (int i = 0; i < 5; i++) {
        const double psi = 0.06 * i;
        struct sample_mean mean = {0};
        struct wave_glint_query q = {{0}, {0, 0, 1}, {0}};
        unit(q.wo, psi * cos(i), psi * sin(i));
        for (int k = 0; k < N_PLACE; k++) { /* about 26 um apart: independent */
            float f;
            q.center_um[0] = 26.3 * (k % 39);
            q.center_um[1] = 26.3 * floor(k / 39.0);
            wave_glint_value(g, &q, &um, 1, true, &f);
            sample_mean_add(&mean, (double)f);
        }
        const double want = (double)q.wo[2] / (0.55 * 0.55) * expected_lobe(0.2, 6, 6, psi, 0.55);
        print_message("psi %.2f: mean %.4f, expected %.4f, standard error %.4f\n", psi, mean.mean, want,
                      sample_mean_se(&mean));
        assert_true(fabs(mean.mean - want) < 4 * sample_mean_se(&mean) + 0.003 * want);
    }
    wave_glint_free(g);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lobes_are_those_of_the_whole_patch),
        cmocka_unit_test(test_other_surfaces),
        cmocka_unit_test(test_models_are_their_integrals),
        cmocka_unit_test(test_a_mirror_has_the_lobe_of_its_window),
        cmocka_unit_test(test_pruning_changes_little),
        cmocka_unit_test(test_the_mean_over_places_is_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
