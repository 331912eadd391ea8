/* Merging exposures: the published figures, dark pixels without bias, saturated samples, pictures. */
#include "base/rng.h"
#include "optimizer/photographs/camera/exposure_merge.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Of a Canon EOS 50D (fiber-scattering thesis, A.4). */
static const struct noise_channel canon = {1.708274, 4.454967, 0.014256, 0.039172, 0.423542};

static void test_golden(void **state)
{
    const double t[3] = {5, 15, 30}, y[3] = {12, 31, 60};
    (void)state;
    struct merged_sample m = exposure_merge(&canon, 3, t, y, 0);
    assert_true(fabs(m.value - 1.93828022) < 5e-9 && fabs(m.se - 0.15085459) < 5e-9 && m.n_used == 3);
    m = exposure_merge(&canon, 3, t, y, 2);
    assert_true(fabs(m.value - 1.93879376) < 5e-9);
}

static void test_left_out_samples(void **state)
{
    const double t[3] = {5, 15, 30}, y[3] = {12, NAN, 60}, none[3] = {NAN, NAN, NAN}, t2[2] = {5, 30}, y2[2] = {12, 60};
    (void)state;
    struct merged_sample m = exposure_merge(&canon, 3, t, y, 2), two = exposure_merge(&canon, 2, t2, y2, 2);
    assert_true(m.n_used == 2 && m.value == two.value && m.se == two.se);
    m = exposure_merge(&canon, 3, t, none, 2);
    assert_true(m.n_used == 0 && isnan(m.value));
    const struct noise_channel unknown = {0};
    m = exposure_merge(&unknown, 3, t, y, 2);
    assert_true(m.value == 72.0 / 35.0 && isnan(m.se));
}

/* At 0.02 DN/s the first estimate is a third too dark; the re-weighted one is not biased. Its stated error is the
 * scatter. */
static void test_dark_pixels(void **state)
{
    enum { N = 40000 };
    const double t[3] = {5, 15, 30}, rate = 0.02;
    double sum[2] = {0}, sum2 = 0.0, se2 = 0.0;
    struct rng_key key = {.seed = 11};
    (void)state;
    for (uint32_t i = 0; i < N; i++) {
        double y[3];
        for (uint32_t k = 0; k < 3; k++) {
            struct rng r;
            double z[2];
            rng_start(&r, &key, i, k);
            rng_normal_pair(&r, z);
            double var = canon.read_var + canon.dark_var * t[k] + canon.shot_var * t[k] * rate;
            y[k] = canon.read_mean + canon.dark_mean * t[k] + t[k] * rate + sqrt(var) * z[0];
        }
        struct merged_sample once = exposure_merge(&canon, 3, t, y, 0), twice = exposure_merge(&canon, 3, t, y, 2);
        sum[0] += once.value / N;
        sum[1] += twice.value / N;
        sum2 += (twice.value - rate) * (twice.value - rate) / N;
        se2 += twice.se * twice.se / N;
    }
    double se = sqrt(sum2 / N);
    if (!(sum[0] < 0.8 * rate && fabs(sum[1] - rate) < 4.0 * se + 0.04 * rate))
        fail_msg("%g %g +- %g", sum[0], sum[1], se);
    assert_true(fabs(sqrt(se2 / sum2) - 1.0) < 0.05);
}

static void test_pictures(void **state)
{
    const double t[2] = {1, 4}, full[2] = {1000, 1000};
    struct image im[2], variance, *list[2] = {&im[0], &im[1]};
    struct noise_record noise = {
        .channel = {{.read_var = 4, .shot_var = 1}, {.read_var = 4, .shot_var = 1}, {.read_var = 4, .shot_var = 1}}};
    double saturated, sum = 0.0;
    (void)state;
    for (int i = 0; i < 2; i++) {
        assert_int_equal(image_init(&im[i], 4, 1, 3, NULL), STATUS_OK);
        for (size_t p = 0; p < 12; p++)
            im[i].pixel[p] = (float)fmin(1.0, 0.05 * (double)(1 + p / 3) * t[i] * (p == 11 ? 30.0 : 1.0));
    }
    assert_int_equal(image_init(&variance, 4, 1, 3, NULL), STATUS_OK);
    const struct exposure_set e = {
        .noise = &noise, .n = 2, .width = 4, .height = 1, .t_s = t, .full_scale = full, .image = list};
    struct exposure_light light = {.region = {0, 0, 3, 1}};
    assert_int_equal(exposure_merge_images(&e, &variance, &light, &saturated, NULL), STATUS_OK);
    for (size_t c = 0; c < 3; c++) { /* the mean of the first three pixels, and most of it by the longer exposure */
        assert_true(fabs(light.light[0][c] + light.light[1][c] - 0.1) < 1e-6);
        assert_true(light.light[1][c] > 3.5 * light.light[0][c] && light.light[1][c] < 5.0 * light.light[0][c]);
    }
    for (size_t p = 0; p < 11; p++) assert_true(fabs((double)im[0].pixel[p] - 0.05 * (double)(1 + p / 3)) < 1e-6);
    assert_true(im[0].pixel[11] == 1.0f && saturated == 0.25); /* saturated in both: the shortest one's value */
    double var = 0.0;
    for (size_t p = 0; p < 4; p++) {
        double y = 50.0 * (double)(1 + p);
        var += 1.0 / (1.0 / (4.0 + y) + 16.0 / (4.0 + 4.0 * y));
    }
    for (size_t p = 0; p < 4; p++) sum += (double)variance.pixel[3 * p];
    assert_true(fabs(sum / (var / 1e6) - 1.0) < 0.02 && variance.pixel[11] == 0.0f);
    image_release(&variance);
    image_release(&im[0]);
    image_release(&im[1]);
}

/* An even picture whose long exposure is just below the full scale, so that noise takes a part of its samples over it:
 * the mean is right within its error. */
static void test_near_saturation(void **state)
{
    enum { EDGE = 80 };
    const double t[2] = {1, 8}, full[2] = {1000, 1000}, rate[4] = {122.0, 123.5, 124.5, 130.0};
    const struct noise_channel k = {.read_var = 4, .shot_var = 0.5};
    const struct noise_record noise = {.channel = {k, k, k}};
    const struct rng_key key = {.seed = 8};
    (void)state;
    for (uint32_t m = 0; m < 4; m++) {
        struct image im[2], variance, *list[2] = {&im[0], &im[1]};
        double saturated, sum = 0.0, var = 0.0;
        assert_int_equal(image_init(&variance, EDGE, EDGE, 3, NULL), STATUS_OK);
        for (uint32_t i = 0; i < 2; i++) {
            assert_int_equal(image_init(&im[i], EDGE, EDGE, 3, NULL), STATUS_OK);
            for (uint32_t p = 0; p < 3 * EDGE * EDGE; p++) {
                struct rng r;
                double z[2], y = rate[m] * t[i];
                rng_start(&r, &key, p, 2 * m + i);
                rng_normal_pair(&r, z);
                im[i].pixel[p] = (float)fmin(1.0, (y + sqrt(4.0 + 0.5 * y) * z[0]) / 1000.0);
            }
        }
        const struct exposure_set e = {
            .noise = &noise, .n = 2, .width = EDGE, .height = EDGE, .t_s = t, .full_scale = full, .image = list};
        assert_int_equal(exposure_merge_images(&e, &variance, NULL, &saturated, NULL), STATUS_OK);
        for (size_t p = 0; p < 3 * EDGE * EDGE; p++) {
            sum += 1000.0 * (double)im[0].pixel[p];
            var += 1e6 * (double)variance.pixel[p];
        }
        double off = sum / (3 * EDGE * EDGE) - rate[m], se = sqrt(var) / (3 * EDGE * EDGE);
        if (!(fabs(off) < 3.5 * se && saturated == 0.0)) fail_msg("%g: off by %g +- %g", rate[m], off, se);
        for (int i = 0; i < 2; i++) image_release(&im[i]);
        image_release(&variance);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_golden),   cmocka_unit_test(test_left_out_samples), cmocka_unit_test(test_dark_pixels),
        cmocka_unit_test(test_pictures), cmocka_unit_test(test_near_saturation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
