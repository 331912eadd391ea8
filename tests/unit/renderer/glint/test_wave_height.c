/* Height fields of wave optics: stated heights and correlation lengths, slopes against differences of the heights,
 * second and third derivatives against their variances, the repeating tile, values that are refused. */
#include "renderer/glint/wave_height.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct wave_height field_of(const struct wave_height_option *o)
{
    struct wave_height h;
    struct error err = {0};
    if (wave_height_init(&h, o, &err) != STATUS_OK) fail_msg("%s", err.text);
    return h;
}

/* Autocorrelation at a shift of texels along u or v. */
static double correlation(const struct wave_height *h, size_t shift_u, size_t shift_v)
{
    double sum = 0, square = 0;
    for (size_t j = 0; j < h->n; j++)
        for (size_t i = 0; i < h->n; i++) {
            const double a = (double)h->height_um[j * h->n + i];
            sum += a * (double)h->height_um[(j + shift_v) % h->n * h->n + (i + shift_u) % h->n];
            square += a * a;
        }
    return sum / square;
}

/* The height is exact. An estimate of a correlation rho over m independent places has the standard error
 * (1 - rho^2) / sqrt(m), and a correlation area of the Gaussian field is pi L_u L_v / 2. */
static void test_heights_and_lengths_are_as_stated(void **state)
{
    (void)state;
    struct wave_height_option o = wave_height_option_usual();
    o.n = 512;
    o.length_um[1] = 16;
    struct wave_height h = field_of(&o);
    double square = 0;
    for (size_t i = 0; i < h.n * h.n; i++) square += pow((double)h.height_um[i], 2) / (double)(h.n * h.n);
    assert_true(fabs(sqrt(square) / o.rms_um - 1) < 1e-5);
    const double places = 512.0 * 512 / (M_PI * 8 * 16 / 2), error = (1 - exp(-2)) / sqrt(places);
    assert_true(fabs(correlation(&h, 8, 0) - exp(-1)) < 4 * error);
    assert_true(fabs(correlation(&h, 0, 16) - exp(-1)) < 4 * error);
    assert_true(correlation(&h, 0, 8) > exp(-1) + 4 * error); /* the two lengths are told apart */
    wave_height_release(&h);
}

/* A central difference of a field whose third derivative is f''' is off by f''' / 6, and that of a Gaussian of the
 * standard deviation s is at most 1.4 f / s^3. */
static void compare_slopes(const struct wave_height *h, double most)
{
    const size_t n = h->n;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++) {
            const float *f = h->height_um;
            const double u = 0.5 * (double)(f[j * n + (i + 1) % n] - f[j * n + (i + n - 1) % n]),
                         v = 0.5 * (double)(f[(j + 1) % n * n + i] - f[(j + n - 1) % n * n + i]);
            assert_true(fabs((double)h->slope_u[j * n + i] - u) < most);
            assert_true(fabs((double)h->slope_v[j * n + i] - v) < most);
        }
}

static void test_slopes_are_derivatives(void **state)
{
    (void)state;
    struct wave_height_option o = wave_height_option_usual();
    o.n = 128;
    struct wave_height h = field_of(&o);
    /* the third derivative of the noise has the root mean square sqrt(120) h / L^3; the largest of 16,384 is below 5 */
    compare_slopes(&h, 5 * sqrt(120) * o.rms_um / pow(8, 3) / 6);
    wave_height_release(&h);
    o.rms_um = 0;
    o.n_scratch = 3;
    o.scratch_depth_um = 0.4;
    o.scratch_width_um = 6;
    h = field_of(&o);
    /* widths from 3; the groove ends at 4 standard deviations, where it is 3.4e-4 of its depth of at most 0.6 */
    compare_slopes(&h, 3 * 0.6 * (1.4 / 27 / 6 + 3.4e-4));
    double deepest = 0, shallowest = 0;
    for (size_t i = 0; i < h.n * h.n; i++) {
        deepest = fmin(deepest, (double)h.height_um[i]);
        shallowest = fmax(shallowest, (double)h.height_um[i]);
    }
    assert_true(deepest < -0.2 && deepest > -1.8);
    assert_true(shallowest <= 0);
    wave_height_release(&h);
}

static void test_seeds_differ_and_repeat(void **state)
{
    (void)state;
    struct wave_height_option o = wave_height_option_usual();
    o.n = 64;
    struct wave_height a = field_of(&o), b = field_of(&o);
    assert_memory_equal(a.height_um, b.height_um, 3 * 64 * 64 * sizeof(float));
    wave_height_release(&b);
    o.seed = 2;
    b = field_of(&o);
    double sum = 0;
    for (size_t i = 0; i < 64 * 64; i++) sum += (double)(a.height_um[i] * b.height_um[i]) / (64 * 64);
    /* 41 independent places: a standard error of 0.16 */
    assert_true(fabs(sum / (o.rms_um * o.rms_um)) < 4 * 0.16);
    wave_height_release(&a);
    wave_height_release(&b);
}

static void is_refused(const struct wave_height_option *o)
{
    struct wave_height h;
    struct error err = {0};
    assert_int_equal(wave_height_init(&h, o, &err), STATUS_INVALID);
    assert_true(strlen(err.text) > 10);
    wave_height_release(&h);
}

static void test_values_out_of_range_are_refused(void **state)
{
    (void)state;
    struct wave_height_option o = wave_height_option_usual();
    o.n = 100;
    is_refused(&o);
    o.n = 128;
    o.length_um[0] = 2;
    is_refused(&o);
    o.length_um[0] = 129;
    is_refused(&o);
    o.length_um[0] = 8;
    o.rms_um = NAN;
    is_refused(&o);
    o.rms_um = 0.1;
    o.texel_um = 0;
    is_refused(&o);
    o.texel_um = 1;
    o.n_scratch = 1;
    o.scratch_width_um = 1;
    is_refused(&o);
}

/* A correlation rms^2 exp(-(x^2 + y^2) / l^2) has the moments 12, 4 rms^2 / l^4 of h_uu, h_uv, and 120, 24, 24
 * rms^2 / l^6 of h_uuu^2, h_uuv^2, h_uuu h_uvv: the variance of the third order is
 * (30 120 + 54 24 + 36 24) / 36 = 160 rms^2 / l^6. Some 2,000 independent places: 4 standard errors are 0.13. */
static void test_curvatures_have_their_variance(void **state)
{
    (void)state;
    struct wave_height_option o = wave_height_option_usual();
    o.length_um[0] = o.length_um[1] = 16;
    struct wave_height h = field_of(&o);
    double uu = 0, uv = 0, vv = 0;
    const double n2 = (double)(h.n * h.n), unit = 0.35 * 0.35 / pow(16, 4);
    assert_int_equal(wave_height_curve(&h, NULL), STATUS_OK);
    for (size_t k = 0; k < h.n * h.n; k++) {
        uu += pow((double)h.curve_uu[k], 2) / n2;
        uv += pow((double)h.curve_uv[k], 2) / n2;
        vv += pow((double)h.curve_vv[k], 2) / n2;
    }
    assert_true(fabs(uu / (12 * unit) - 1) < 0.13);
    assert_true(fabs(uv / (4 * unit) - 1) < 0.13);
    assert_true(fabs(vv / (12 * unit) - 1) < 0.13);
    assert_true(fabs(wave_height_rest(&h, 1) / (pow(2 * M_PI * 2 / 0.5, 2) * 160 * unit / 256) - 1) < 0.13);
    wave_height_release(&h);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_heights_and_lengths_are_as_stated), cmocka_unit_test(test_slopes_are_derivatives),
        cmocka_unit_test(test_curvatures_have_their_variance),    cmocka_unit_test(test_seeds_differ_and_repeat),
        cmocka_unit_test(test_values_out_of_range_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
