/* The tone curve of pictures for the eye: which colors it leaves, what it does with highlights, and its dither. */
#include "renderer/image/tone_curve.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static void mid_tones_stay(void **state)
{
    (void)state;
    double grey[3] = {0.18, 0.18, 0.18}, red[3] = {0.6, 0.0, 0.0};
    tone_curve_apply(grey);
    tone_curve_apply(red);
    for (int c = 0; c < 3; c++) assert_true(fabs(grey[c] - (0.14)) <= 1e-12); /* less the glare of 4 % */
    assert_true(fabs(red[0] - (0.6)) <= 1e-12);
    assert_true(fabs(red[1] - (0.0)) <= 1e-12);
}

static void highlights_grow_below_one_and_keep_their_hue(void **state)
{
    (void)state;
    double before = 0.0;
    for (double level = 0.01; level < 1e5; level *= 1.1) {
        double rgb[3] = {level, 0.5 * level, 0.1 * level};
        tone_curve_apply(rgb);
        assert_true(rgb[0] > before && rgb[0] < 1.0);
        assert_true(rgb[0] >= rgb[1] && rgb[1] >= rgb[2] && rgb[2] >= 0.0);
        if (level < 5.0) assert_true(rgb[2] < 0.6 * rgb[0]); /* far from white where a cut would give 1, 1, .5 */
        before = rgb[0];
    }
}

static void dither_keeps_the_mean(void **state)
{
    (void)state;
    struct image im;
    struct error err;
    enum { N = 128 };
    assert_int_equal(image_init(&im, N, N, 3, &err), STATUS_OK);
    for (size_t i = 0; i < 3 * N * N; i++) im.pixel[i] = 0.18f;
    uint8_t *rgb = malloc(3 * N * N);
    tone_curve_bytes(&im, 1.0, rgb);
    double mean = 0.0;
    const double wanted = 255.0 * (1.055 * pow(0.14, 1.0 / 2.4) - 0.055);
    for (size_t i = 0; i < 3 * N * N; i++) {
        mean += rgb[i] / (3.0 * N * N);
        assert_true(fabs(rgb[i] - wanted) <= 1.0);
    }
    assert_true(fabs(mean - (wanted)) <= 0.01);
    free(rgb);
    image_release(&im);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mid_tones_stay),
        cmocka_unit_test(highlights_grow_below_one_and_keep_their_hue),
        cmocka_unit_test(dither_keeps_the_mean),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
