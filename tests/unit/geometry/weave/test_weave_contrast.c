/* Contrast at three scales against its closed form for sinusoids, and the errors between two pictures. */
#include "base/rng.h"
#include "geometry/vision/vision.h"
#include "geometry/vision/vision_texture.h"
#include "geometry/weave/weave_contrast.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 256 };
static float grey[EDGE * EDGE], rgb[3 * EDGE * EDGE];

static void draw_wave(double mean, double amplitude, double period_px)
{
    for (size_t i = 0; i < EDGE * EDGE; i++)
        grey[i] = (float)(mean * (1.0 + amplitude * sin(2.0 * M_PI * (double)(i % EDGE) / period_px)));
}

/* Share of a wave that the band of a scale passes. */
static double band(double scale_px, double period_px)
{
    double x = M_PI * scale_px / 8.0 / period_px;
    return exp(-2.0 * x * x) - exp(-8.0 * x * x);
}

static void sinusoids_have_the_contrast_of_the_closed_form(void **state)
{
    (void)state;
    struct error err = {0};
    for (double wave_px = 8.0; wave_px < 40.0; wave_px *= 2.0) {
        double contrast[WEAVE_SCALES], period_px = 16.0;
        draw_wave(0.3, 0.2, wave_px);
        assert_int_equal(weave_contrast(grey, EDGE, EDGE, period_px, contrast, &err), STATUS_OK);
        for (int k = 0; k < WEAVE_SCALES; k++) {
            double wanted = 0.2 / sqrt(2.0) * band(period_px * pow(2.0, k - 1), wave_px);
            assert_true(fabs(contrast[k] / wanted - 1.0) < 0.03);
        }
    }
}

static void magnification_does_not_matter(void **state)
{
    (void)state;
    struct error err = {0};
    double near[WEAVE_SCALES], far[WEAVE_SCALES];
    draw_wave(0.3, 0.2, 20.0);
    assert_int_equal(weave_contrast(grey, EDGE, EDGE, 20.0, near, &err), STATUS_OK);
    draw_wave(3.0, 0.2, 10.0);
    assert_int_equal(weave_contrast(grey, EDGE, EDGE, 10.0, far, &err), STATUS_OK);
    for (int k = 0; k < WEAVE_SCALES; k++) assert_true(fabs(far[k] / near[k] - 1.0) < 0.05);
}

static void periods_that_do_not_fit_are_refused(void **state)
{
    (void)state;
    struct error err = {0};
    double contrast[WEAVE_SCALES];
    assert_int_equal(weave_contrast(grey, EDGE, EDGE, 1.9, contrast, &err), STATUS_INVALID);
    assert_int_equal(weave_contrast(grey, EDGE, EDGE, EDGE / 7.0, contrast, &err), STATUS_INVALID);
    assert_int_equal(weave_contrast(grey, EDGE, EDGE, NAN, contrast, &err), STATUS_INVALID);
}

static void fill_rgb(double red, double green, double blue)
{
    for (size_t i = 0; i < EDGE * EDGE; i++) {
        rgb[3 * i] = grey[i] * (float)red;
        rgb[3 * i + 1] = grey[i] * (float)green;
        rgb[3 * i + 2] = grey[i] * (float)blue;
    }
}

static void errors_between_pictures_are_relative(void **state)
{
    (void)state;
    struct error err = {0};
    struct weave_look photograph, rendering;
    draw_wave(0.5, 0.2, 16.0);
    fill_rgb(1.0, 0.5, 0.1);
    assert_int_equal(weave_look_measure(rgb, EDGE, EDGE, 16.0, &photograph, &err), STATUS_OK);
    assert_true(weave_color_error(&photograph, &photograph) == 0.0);
    draw_wave(0.5, 0.3, 16.0); /* half as much contrast again, and a blue that is 30 % too bright */
    fill_rgb(1.0, 0.5, 0.13);
    assert_int_equal(weave_look_measure(rgb, EDGE, EDGE, 16.0, &rendering, &err), STATUS_OK);
    assert_true(fabs(weave_color_error(&rendering, &photograph) - 0.3 / sqrt(3.0)) < 1e-3);
    assert_true(fabs(weave_contrast_error(&rendering, &photograph) - 0.5) < 0.02);
}

/* White noise without a texture, as it is and blurred: what is stated is what is measured. */
static void noise_is_stated(void **state)
{
    (void)state;
    static float blurred[EDGE * EDGE];
    struct error err = {0};
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 3}, 0, 0);
    for (size_t i = 0; i < EDGE * EDGE; i += 2) {
        double normal[2];
        rng_normal_pair(&rng, normal);
        for (size_t k = 0; k < 2; k++) grey[i + k] = (float)(0.4 + 0.02 * normal[k]);
    }
    for (double blur_px = 0.0; blur_px < 1.0; blur_px += 0.6) {
        double measured[WEAVE_SCALES], stated[WEAVE_SCALES];
        if (blur_px > 0.0) assert_int_equal(vision_smooth(grey, EDGE, EDGE, blur_px, blurred, &err), STATUS_OK);
        const float *picture = blur_px > 0.0 ? blurred : grey;
        assert_int_equal(weave_contrast(picture, EDGE, EDGE, 5.0, measured, &err), STATUS_OK);
        assert_int_equal(weave_contrast_noise(0.0025, blur_px, 5.0, stated, &err), STATUS_OK);
        for (int k = 0; k < WEAVE_SCALES; k++) assert_true(fabs(measured[k] * measured[k] / stated[k] - 1.0) < 0.06);
    }
    double square[WEAVE_SCALES];
    assert_int_equal(weave_contrast_noise(0.1, -1.0, 5.0, square, &err), STATUS_INVALID);
}

int main(void)
{
    struct error err = {0};
    if (vision_init(&err) != STATUS_OK) return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sinusoids_have_the_contrast_of_the_closed_form),
        cmocka_unit_test(magnification_does_not_matter),
        cmocka_unit_test(periods_that_do_not_fit_are_refused),
        cmocka_unit_test(errors_between_pictures_are_relative),
        cmocka_unit_test(noise_is_stated),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
