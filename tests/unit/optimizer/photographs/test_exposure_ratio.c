/* Exposure times by the light that exposures have in common: right within their stated errors over many cameras, wrong
 * times named, impossible ones and differently balanced colors refused, and the rounding of cameras. */
#include "base/rng.h"
#include "optimizer/photographs/camera/exposure_carry.h"
#include "optimizer/photographs/camera/exposure_ratio.h"
#include "optimizer/photographs/camera/exposure_series.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 96, N = 3 };

static const char *const name[N] = {"short", "middle", "long"};
static const double stated_s[N] = {0.02, 0.16, 1.28}, full[N] = {16000, 16000, 16000};
static const struct noise_channel raw_noise = {.read_var = 16, .dark_var = 1.5, .shot_var = 0.5};

/* A view: the rate of each pixel and channel, the true times, and a change of one exposure. */
struct view {
    double base, contrast, true_s[N];
    double gain[N][3]; /* of the channels of an exposure; 0: 1 */
    size_t shift[N];   /* pixels by which an exposure has moved */
    bool noise_known;
    double black_sd_dn; /* error of the level of black of an exposure */
    double round_to;    /* levels of the full scale; 0: none */
    uint64_t seed;
};

static double rate_at(const struct view *v, size_t x, size_t y, size_t c)
{
    const double wave = sin(0.9 * (double)x) * sin(0.7 * (double)y) + ((x / 24 + y / 24) % 2 == 0 ? 1.0 : -1.0);
    return v->base * (1.0 + 0.5 * v->contrast * wave) * (c == 2 ? 0.5 : 1.0);
}

static void expose(const struct view *v, size_t i, struct image *im)
{
    const struct rng_key key = {.seed = v->seed};
    struct rng of_black;
    double black[2];
    rng_start(&of_black, &key, 1 << 20, (uint32_t)i);
    rng_normal_pair(&of_black, black);
    assert_int_equal(image_init(im, EDGE, EDGE, 3, NULL), STATUS_OK);
    for (size_t p = 0; p < 3 * EDGE * EDGE; p++) {
        const size_t x = p / 3 % EDGE, y = p / 3 / EDGE;
        const double gain = v->gain[i][p % 3] > 0.0 ? v->gain[i][p % 3] : 1.0;
        const double light = rate_at(v, x + v->shift[i], y, p % 3) * v->true_s[i] * gain;
        struct rng r;
        double z[2];
        rng_start(&r, &key, (uint32_t)p, (uint32_t)i);
        rng_normal_pair(&r, z);
        const double var = raw_noise.read_var + raw_noise.dark_var * v->true_s[i] + raw_noise.shot_var * light;
        double dn = rint(light + v->black_sd_dn * black[0] + sqrt(var) * z[0]);
        if (v->round_to > 0.0) dn = full[i] / v->round_to * rint(light / full[i] * v->round_to);
        im->pixel[p] = (float)fmin(1.0, dn / full[i]);
    }
}

static status fit(const struct view *v, const double *rank, struct exposure_ratio *r, struct error *err)
{
    static const struct noise_record record = {.channel = {raw_noise, raw_noise, raw_noise}};
    struct image im[N], *list[N] = {&im[0], &im[1], &im[2]};
    const double levels[N] = {v->round_to, v->round_to, v->round_to};
    for (size_t i = 0; i < N; i++) expose(v, i, &im[i]);
    const struct exposure_set e = {.noise = v->noise_known ? &record : NULL,
                                   .n = N,
                                   .width = EDGE,
                                   .height = EDGE,
                                   .t_s = stated_s,
                                   .full_scale = v->round_to > 0.0 ? levels : full,
                                   .image = list,
                                   .name = name};
    const status s = exposure_ratio_fit(&e, rank, r, err);
    for (size_t i = 0; i < N; i++) image_release(&im[i]);
    return s;
}

/* Over bright and dark views, even and textured ones, with a record of the noise and without: the deviations of the
 * fitted times, over their errors, have the scatter 1. */
static void test_errors_are_the_scatter(void **state)
{
    static const struct {
        double base, contrast;
        bool noise_known;
    } kind[] = {{6000, 0.3, true}, {600, 0.6, true}, {150, 0.9, true}, {30000, 0.0, true}, {6000, 0.3, false}};
    enum { SEEDS = 60 };
    static const double rank[N] = {1, 0, 1};
    (void)state;
    for (size_t k = 0; k < sizeof kind / sizeof *kind; k++) {
        double square[N] = {0}, largest = 0.0, error = 0.0;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            const struct view v = {.base = kind[k].base,
                                   .contrast = kind[k].contrast,
                                   .true_s = {0.021, 0.16, 1.216},
                                   .noise_known = kind[k].noise_known,
                                   .black_sd_dn = kind[k].noise_known ? 0.1 : 0.5,
                                   .seed = 100 * k + seed};
            struct exposure_ratio r;
            struct error err = {0};
            if (fit(&v, rank, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
            assert_true(r.i_scale == 1 && r.t_s[1] == 0.16 && strstr(r.warning, "is stated as") != NULL);
            for (size_t i = 0; i < N; i += 2) {
                const double z = log(r.t_s[i] / v.true_s[i]) / exposure_ratio_error(&r, i);
                square[i] += z * z / SEEDS;
                largest = fmax(largest, fabs(z));
                error = fmax(error, exposure_ratio_error(&r, i));
            }
        }
        print_message("base %g contrast %g: z %.2f %.2f, largest %.2f, error to %.5f\n", kind[k].base, kind[k].contrast,
                      sqrt(square[0]), sqrt(square[2]), largest, error);
        for (size_t i = 0; i < N; i += 2)
            assert_true(sqrt(square[i]) < 1.25 && (!kind[k].noise_known || sqrt(square[i]) > 0.75));
        assert_true(largest < 4.0);
        assert_true(kind[k].base > 2e4 ? fabs(error - 0.05) < 1e-6 : error < 0.03); /* the longest is saturated */
    }
}

/* Times as stated give no warning, and 1/64 s in place of 1/60 s gives one with both numbers. */
static void test_warnings(void **state)
{
    struct view v = {.base = 3000, .contrast = 0.3, .true_s = {0.02, 0.16, 1.28}, .noise_known = true, .seed = 5};
    struct exposure_ratio r;
    struct error err = {0};
    (void)state;
    assert_int_equal(fit(&v, NULL, &r, &err), STATUS_OK);
    assert_true(r.warning[0] == '\0' && r.i_scale == 2); /* the longest keeps its time */
    v.true_s[0] = 0.02 * 60.0 / 64.0;
    assert_int_equal(fit(&v, NULL, &r, &err), STATUS_OK);
    if (strstr(r.warning, "'short' is stated as 0.02 s") == NULL || strstr(r.warning, "it lasted 0.01873 s") == NULL ||
        strstr(r.warning, "'long' keeps its stated time") == NULL)
        fail_msg("%s", r.warning);
    v.true_s[0] = 0.02;
    v.shift[1] = 9;
    assert_int_equal(fit(&v, NULL, &r, &err), STATUS_OK);
    if (strstr(r.warning, "over the picture") == NULL) fail_msg("a moved exposure: '%s'", r.warning);
    assert_true(exposure_ratio_error(&r, 0) > 0.002); /* which the error contains */
}

/* 8-bit pictures without noise: their steps are in the error. */
static void test_steps(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 20; seed++) {
        const struct view v = {
            .base = 2500 + 300 * (double)seed, .true_s = {0.02, 0.16, 1.28}, .round_to = 255, .seed = seed};
        struct exposure_ratio r;
        struct error err = {0};
        if (fit(&v, NULL, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
        for (size_t i = 0; i < N; i++)
            assert_true(fabs(log(r.t_s[i] / v.true_s[i])) <= 2.0 * exposure_ratio_error(&r, i));
        assert_true(r.warning[0] == '\0');
    }
}

/* Stripes that saturate the longer exposure. Beside them a green of two samples, one of them saturated, is too dark,
 * although it is far from the full scale. */
static void test_edges_of_saturation(void **state)
{
    static const double t[2] = {0.16, 1.28}, level[2] = {16000, 16000};
    struct image im[2], *list[2] = {&im[0], &im[1]};
    const struct exposure_set e = {
        .n = 2, .width = EDGE, .height = EDGE, .t_s = t, .full_scale = level, .image = list, .name = name};
    struct exposure_ratio r;
    struct error err = {0};
    (void)state;
    for (size_t i = 0; i < 2; i++) assert_int_equal(image_init(&im[i], EDGE, EDGE, 3, NULL), STATUS_OK);
    for (size_t p = 0; p < 3 * EDGE * EDGE; p++) {
        const size_t column = p / 3 % EDGE % 12;
        const double dark = 0.1 + 1e-3 * (double)(p % 7), bright = 1.6;
        const bool edge = p % 3 == 1 && (column == 6 || column == 11);
        const double light = column < 6 ? bright : edge ? 0.5 * (dark + bright) : dark;
        im[0].pixel[p] = (float)(light / 8.0);
        im[1].pixel[p] = (float)(edge ? 0.5 * (dark + 1.0) : fmin(light, 1.0));
    }
    if (exposure_ratio_fit(&e, NULL, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(fabs(r.t_s[0] / 0.16 - 1.0) < 1e-3);
    for (size_t i = 0; i < 2; i++) image_release(&im[i]);
}

static void test_balance(void **state)
{
    struct view v = {.base = 3000,
                     .contrast = 0.3,
                     .true_s = {0.02, 0.16, 1.28},
                     .noise_known = true,
                     .seed = 6,
                     .gain = {{0}, {1.06, 1.0, 0.97}, {0}}};
    struct exposure_ratio r;
    struct error err = {0};
    (void)state;
    assert_int_equal(fit(&v, NULL, &r, &err), STATUS_INVALID);
    if (strstr(err.text, "'short' and 'middle'") == NULL || strstr(err.text, "balanced differently") == NULL)
        fail_msg("%s", err.text);
}

/* Exposure times that contradict the light are refused with the exposure at fault; those of a shutter that is 10 % off
 * are not, and neither are an exposure that is all dark and one that is all saturated. */
static void test_agreement(void **state)
{
    static const double light[][3] = {
        {1.0, 4.0, 16.0}, {1.1, 4.0, 16.0}, {100.0, 4.0, 16.0}, {1.0, 4.0, 5.0}, {1.0, 2.0, 16.0}};
    static const char *const fault[] = {NULL, NULL, "'short' has 1e+02 times", "'long' has 0.31 times",
                                        "'middle' has 0.5 times"};
    const double t[3] = {1, 4, 16}, level[3] = {1000, 1000, 1000};
    struct image im[3], *list[3] = {&im[0], &im[1], &im[2]};
    const struct exposure_set e = {
        .n = 3, .width = 8, .height = 8, .t_s = t, .full_scale = level, .image = list, .name = name};
    struct exposure_ratio r;
    (void)state;
    for (int i = 0; i < 3; i++) assert_int_equal(image_init(&im[i], 8, 8, 3, NULL), STATUS_OK);
    for (size_t k = 0; k < sizeof light / sizeof light[0]; k++) {
        struct error err = {0};
        for (int i = 0; i < 3; i++)
            for (size_t p = 0; p < 192; p++)
                im[i].pixel[p] = (float)(0.008 * light[k][i] * (0.5 + 0.5 * (double)(p % 3)));
        status s = exposure_ratio_fit(&e, NULL, &r, &err);
        assert_int_equal(s, fault[k] == NULL ? STATUS_OK : STATUS_INVALID);
        if (fault[k] != NULL && strstr(err.text, fault[k]) == NULL) fail_msg("%zu: %s", k, err.text);
    }
    for (size_t p = 0; p < 192; p++) {
        im[0].pixel[p] = 1e-4f;
        im[1].pixel[p] = 1e-4f;
        im[2].pixel[p] = 1.0f;
    }
    assert_int_equal(exposure_ratio_fit(&e, NULL, &r, NULL), STATUS_OK);
    for (int i = 0; i < 3; i++) image_release(&im[i]);
}

/* Values of the series are exact, and numbers that no camera rounds to. */
static void test_rounding(void **state)
{
    static const struct {
        double stated, truth;
    } time[] = {{1.0 / 60, 1.0 / 64},
                {1.0 / 64, 1.0 / 64},
                {1.0 / 125, 1.0 / 128},
                {1.0 / 30, 1.0 / 32},
                {15, 16},
                {0.5, 0.5},
                {1.0 / 50, 1.0 / 50.797},
                {1.0 / 90, 1.0 / 90.51},
                {0.0123, 0.0123},
                {0.16, 0.16},
                {30, 32}},
      aperture[] = {{11, 11.3137}, {5.6, 5.65685}, {22, 22.6274}, {8, 8}, {3.5, 3.5636}, {1.2, 1.1892}, {7.3, 7.3}},
      iso[] = {{100, 100}, {125, 125.992}, {1250, 1269.92}, {640, 634.96}, {3200, 3200}, {117, 117}, {50, 50}};
    (void)state;
    for (size_t i = 0; i < sizeof time / sizeof *time; i++)
        if (fabs(exposure_time_rounding(time[i].stated) - log(time[i].truth / time[i].stated)) > 1e-4)
            fail_msg("%g s: %g", time[i].stated, exposure_time_rounding(time[i].stated));
    for (size_t i = 0; i < sizeof aperture / sizeof *aperture; i++)
        if (fabs(exposure_aperture_rounding(aperture[i].stated) - log(aperture[i].truth / aperture[i].stated)) > 1e-4)
            fail_msg("f/%g: %g", aperture[i].stated, exposure_aperture_rounding(aperture[i].stated));
    for (size_t i = 0; i < sizeof iso / sizeof *iso; i++)
        if (fabs(exposure_iso_rounding(iso[i].stated) - log(iso[i].truth / iso[i].stated)) > 1e-4)
            fail_msg("ISO %g: %g", iso[i].stated, exposure_iso_rounding(iso[i].stated));
    struct photograph_record r = {.scale_s = 1.0 / 60, .info.aperture = 11, .info.iso = 1250};
    const double mean[3] = {0.5, 0.2, 0.1};
    double se[3] = {0.01, 0.0, 0.0};
    exposure_rounding_state(&r, &(struct exposure_reference){1.0 / 8, 8, 100}, mean, se);
    const double of_all = hypot(log(1269.92 / 1250), hypot(log(64.0 / 60), 2.0 * log(11.3137 / 11)));
    assert_true(fabs(se[1] / 0.2 - of_all) < 1e-4);
    assert_true(fabs(se[0] - hypot(0.01, 0.5 * se[1] / 0.2)) < 1e-9);
    exposure_rounding_state(&r, &(struct exposure_reference){1.0 / 60, 11, 1250}, mean, memset(se, 0, sizeof se));
    assert_true(se[0] == 0.0 && photograph_color_se(&r, 0) == 0.0); /* the chart ties them */
    r.info.aperture = r.info.iso = r.scale_s = NAN;
    exposure_rounding_state(&r, &(struct exposure_reference){NAN, NAN, NAN}, mean, se);
    assert_true(se[0] == 0.0);
}

/* The ratio of a view that has none: the mean of the same stated exposures, with the scatter between views. */
static void test_carried_ratios(void **state)
{
    static const double t_s[2] = {0.02, 0.16}, other_s[2] = {0.02, 0.2};
    static const double measured[4] = {0.05, 0.07, 0.06, 0.06};
    const struct photograph_info info = {.iso = 100, .aperture = NAN}, other_iso = {.iso = 200, .aperture = NAN};
    const struct exposure_set view = {.n = 2, .t_s = t_s}, other = {.n = 2, .t_s = other_s};
    struct exposure_carry carry = {0};
    struct exposure_pair none = {.shorter = 0, .longer = 1, .var = INFINITY}, pair = none;
    (void)state;
    exposure_carry_fill(&carry, &view, &info, &pair);
    assert_true(isinf(pair.var));
    assert_int_equal(exposure_carry_add(&carry, &view, &info, &none, NULL), STATUS_OK);
    assert_int_equal(carry.n, 0);
    for (size_t i = 0; i < 40; i++) {
        const struct exposure_pair of = {.shorter = 0, .longer = 1, .value = measured[i % 4], .var = 1e-8};
        assert_int_equal(exposure_carry_add(&carry, &view, &info, &of, NULL), STATUS_OK);
    }
    exposure_carry_fill(&carry, &other, &info, &pair);
    exposure_carry_fill(&carry, &view, &other_iso, &pair);
    assert_true(isinf(pair.var));
    exposure_carry_fill(&carry, &view, &info, &pair);
    assert_float_equal(pair.value, 0.06, 1e-9);
    assert_float_equal(sqrt(pair.var), sqrt((1e-4 + 40 * 0.5e-4) / 40 * (1.0 + 1.0 / 40)), 1e-4); /* scatter 0.0071 */
    pair = (struct exposure_pair){.shorter = 0, .longer = 1, .value = 0.3, .var = 1e-4};
    exposure_carry_fill(&carry, &view, &info, &pair);
    assert_true(pair.value == 0.3); /* the view's own */
    exposure_carry_release(&carry);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_errors_are_the_scatter),
        cmocka_unit_test(test_warnings),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_balance),
        cmocka_unit_test(test_edges_of_saturation),
        cmocka_unit_test(test_agreement),
        cmocka_unit_test(test_rounding),
        cmocka_unit_test(test_carried_ratios),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
