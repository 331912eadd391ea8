/* How far two pictures are apart: closed forms, with noise and without. */
#include "optimizer/report/surface/surface_difference.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

enum { EDGE = 64, N_CHANNEL = 6 };

static struct image picture(double value, double variance)
{
    struct image im = {.width = EDGE, .height = EDGE, .n_channel = N_CHANNEL};
    im.pixel = malloc(sizeof(float[EDGE][EDGE][N_CHANNEL]));
    assert_non_null(im.pixel);
    for (size_t i = 0; i < EDGE * EDGE; i++)
        for (size_t k = 0; k < N_CHANNEL; k++)
            im.pixel[i * N_CHANNEL + k] = (float)(k < 3 ? value * (double)(k + 1) : variance);
    return im;
}

/* A factor of 1.5 between two pictures of rgb 1, 2, 3: differences .5, 1, 1.5 over the mean brightness 2. */
static void a_factor_without_noise(void **unused)
{
    (void)unused;
    struct image a = picture(1.5, 0.0), b = picture(1.0, 0.0);
    struct surface_difference d;
    surface_difference_of(&a, &b, &d);
    for (int k = 0; k < 3; k++) assert_true(fabs(d.mean[k] - 0.25 * (k + 1)) < 1e-6);
    assert_true(fabs(d.field_rms - sqrt((0.25 + 1.0 + 2.25) / 3.0) / 2.0) < 1e-6);
    assert_true(d.field_noise == 0.0);
    free(a.pixel), free(b.pixel);
}

/* The dark half counts for the mean of the whole, not for the fields. */
static void fields_in_the_dark_do_not_count(void **unused)
{
    (void)unused;
    struct image a = picture(1.5, 0.0), b = picture(1.0, 0.0);
    for (size_t i = 0; i < EDGE * EDGE / 2 * N_CHANNEL; i++) a.pixel[i] = b.pixel[i] = 0.0f;
    struct surface_difference d;
    surface_difference_of(&a, &b, &d);
    assert_true(fabs(d.mean[1] - 0.5) < 1e-6);
    assert_true(fabs(d.field_rms - sqrt((0.25 + 1.0 + 2.25) / 3.0) / 2.0) < 1e-6);
    for (size_t i = 0; i < EDGE * EDGE * N_CHANNEL; i++) b.pixel[i] = 0.0f;
    surface_difference_of(&a, &b, &d);
    assert_true(isnan(d.mean[0]) && isnan(d.field_rms));
    free(a.pixel), free(b.pixel);
}

/* Uniform noise of the stated variance on both pictures, and a checker of fields between them of known contrast c. The
 * noise s of a field is taken off. The mean square of c plus noise over n = 3 x 256 fields has the standard error
 * sqrt((2 s^4 + 4 s^2 c^2) / n). Four of them are allowed, which is less than s^2: a sum with its noise would fail. */
static void noise_is_taken_off(void **unused)
{
    (void)unused;
    const double variance = 0.04, contrast = 0.1;
    struct image a = picture(1.0, variance), b = picture(1.0, variance);
    uint64_t state = 7;
    for (size_t i = 0; i < EDGE * EDGE; i++)
        for (size_t k = 0; k < 3; k++) {
            struct image *const each[2] = {&a, &b};
            for (int n = 0; n < 2; n++) {
                state = state * 6364136223846793005u + 1442695040888963407u;
                double u = (double)(state >> 11) * 0x1p-53;
                each[n]->pixel[i * N_CHANNEL + k] += (float)((u - 0.5) * sqrt(12.0 * variance));
            }
            bool odd = ((i % EDGE) / 4 + i / EDGE / 4) % 2 == 1;
            a.pixel[i * N_CHANNEL + k] += (float)(odd ? contrast : -contrast);
        }
    struct surface_difference d;
    surface_difference_of(&a, &b, &d);
    const double noise = sqrt(2.0 * variance / 16.0), square = 4.0 * d.field_rms * d.field_rms;
    const double allowed = 4.0 * noise * sqrt((2.0 * noise * noise + 4.0 * contrast * contrast) / 768.0);
    assert_true(fabs(d.field_noise - noise / 2.0) < 1e-3 * noise);
    assert_true(fabs(square - contrast * contrast) < allowed && allowed < noise * noise);
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(d.mean_se[k] - sqrt(2.0 * variance) / EDGE / 2.0) < 1e-5);
        assert_true(fabs(d.mean[k]) < 4.0 * d.mean_se[k]);
    }
    free(a.pixel), free(b.pixel);
}

/* A preview does not state its variances: the noise of the reference alone, sqrt(v / 16) over the brightness 2, is
 * taken off the differences of .5, 1 and 1.5. */
static void variances_that_are_not_known(void **unused)
{
    (void)unused;
    const double variance = 0.04;
    struct image a = picture(1.5, NAN), b = picture(1.0, variance);
    struct surface_difference d;
    surface_difference_of(&a, &b, &d);
    assert_true(fabs(d.field_noise - sqrt(variance / 16.0) / 2.0) < 1e-6);
    assert_true(fabs(d.field_rms - sqrt((0.25 + 1.0 + 2.25) / 3.0 - variance / 16.0) / 2.0) < 1e-6);
    assert_true(fabs(d.mean_se[0] - sqrt(variance) / EDGE / 2.0) < 1e-6);
    free(a.pixel), free(b.pixel);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_factor_without_noise),
        cmocka_unit_test(fields_in_the_dark_do_not_count),
        cmocka_unit_test(noise_is_taken_off),
        cmocka_unit_test(variances_that_are_not_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
