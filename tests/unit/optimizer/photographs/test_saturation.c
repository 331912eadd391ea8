/* Clipped pictures of every container are found, and bright or flat ones that are not clipped are left alone. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/photographs/reader/saturation.h"
#include "tests/support/camera_files.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/stated_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 96, N_PIXEL = EDGE * EDGE };

static uint32_t noise_state = 1;

static double uniform(void)
{
    noise_state = noise_state * 1664525u + 1013904223u;
    return ((noise_state >> 8) + 0.5) / 16777216.0;
}

static double normal(void) { return sqrt(-2.0 * log(uniform())) * cos(6.283185307179586 * uniform()); }

/* Measures a picture of 16 bits and returns its share of saturated pixels. */
static double share_of(void **state, const uint16_t *sample, const struct file_part *part, size_t n_part)
{
    const char *path = scratch_path(state, "a.png");
    const struct job_photograph p = photograph_plain(JOB_TRANSFER_LINEAR);
    struct photograph_mean m;
    struct error err = {0};
    stated_write_png(path, EDGE, EDGE, 16, 3, sample, part, n_part);
    status s = photograph_measure(path, &p, &m, &err);
    if (m.record.saturated_share > 0.02)
        assert_non_null(strstr(err.text, "saturated"));
    else if (s != STATUS_OK)
        fail_msg("%s", err.text);
    return m.record.saturated_share;
}

/* Cloth with texture of 15 % and noise, of `bits` bits in 16, shifted by `shift`; a share of it is above full scale in
 * the channels of the mask. */
static void test_clipped(void **state)
{
    static uint16_t sample[3 * N_PIXEL];
    for (unsigned bits = 10; bits <= 14; bits++)
        for (unsigned shift = 0; shift <= 16 - bits; shift += 16 - bits)
            for (unsigned mask = 1; mask < 8; mask++) {
                const double top = (1u << bits) - 1;
                size_t n_clipped = 0;
                for (size_t i = 0; i < N_PIXEL; i++) {
                    bool clipped = false;
                    for (unsigned c = 0; c < 3; c++) {
                        double v = top * ((mask >> c & 1 ? 0.9 : 0.4) + (mask >> c & 1 ? 0.12 : 0.05) * normal());
                        clipped = clipped || lrint(v) >= top;
                        sample[3 * i + c] = (uint16_t)((unsigned)lrint(fmin(fmax(v, 0.0), top)) << shift);
                    }
                    n_clipped += clipped;
                }
                assert_true(share_of(state, sample, NULL, 0) == (double)n_clipped / N_PIXEL);
            }
}

/* A level that is no power of two, as a white level of a raw file that was subtracted and scaled. */
static void test_any_level(void **state)
{
    static uint16_t sample[3 * N_PIXEL];
    for (double top = 9000.0; top < 65000.0; top *= 1.7) {
        size_t n_clipped = 0;
        for (size_t i = 0; i < N_PIXEL; i++) {
            bool clipped = false;
            for (unsigned c = 0; c < 3; c++) {
                double v = top * (0.7 + 0.2 * normal());
                clipped = clipped || lrint(v) >= floor(top);
                sample[3 * i + c] = (uint16_t)lrint(fmin(fmax(v, 0.0), floor(top)));
            }
            n_clipped += clipped;
        }
        assert_true(share_of(state, sample, NULL, 0) == (double)n_clipped / N_PIXEL);
    }
}

/* Clipped cloth before a black ground: its pile of zeros does not make the picture a synthetic one. */
static void test_black_ground(void **state)
{
    static uint16_t sample[3 * N_PIXEL];
    size_t n_clipped = 0;
    for (size_t i = 0; i < N_PIXEL; i++) {
        bool clipped = false;
        for (unsigned c = 0; c < 3; c++) {
            const double v = i % 3 == 0 ? 0.0 : 40000.0 * (0.7 + 0.2 * normal());
            clipped = clipped || lrint(v) >= 40000;
            sample[3 * i + c] = (uint16_t)lrint(fmin(fmax(v, 0.0), 40000.0));
        }
        n_clipped += clipped;
    }
    assert_true(n_clipped > 0 && share_of(state, sample, NULL, 0) == (double)n_clipped / N_PIXEL);
}

/* sBIT and MaxSampleValue say what the largest value is, also for a picture of one value. */
static void test_stated(void **state)
{
    static uint16_t sample[3 * N_PIXEL];
    for (size_t i = 0; i < 3 * N_PIXEL; i++) sample[i] = (uint16_t)(i % 90 < 3 ? 1023 << 6 : 500 << 6);
    assert_true(share_of(state, sample, &(struct file_part){"sBIT", 0, "\12\12\12", 3}, 1) > 0.03);
}

/* Noiseless and noisy pictures that reach their largest value honestly. */
static void test_not_clipped(void **state)
{
    static uint16_t sample[3 * N_PIXEL];
    for (int kind = 0; kind < 12; kind++)
        for (unsigned step = 1; step <= 256; step *= 4) { /* quantised as in 16, 14, 12, 10 and 8 bits */
            for (size_t i = 0; i < N_PIXEL; i++) {
                const double x = (double)(i % EDGE) / EDGE * 2.0 - 1.0, y = (double)(i / EDGE) / EDGE * 2.0 - 1.0;
                const double r = hypot(x, y), bulk = 0.9 - 0.06 * fabs(normal());
                const double value[12] = {
                    0.9 + 0.02 * normal(),                                                     /* bright and even */
                    0.95 - 0.4 * x * x,                                                        /* a ridge */
                    0.95 * sqrt(fmax(0.0, 1.0 - r * r)),                                       /* a ball */
                    0.95 * (1.0 - pow(fabs(x), 4.0)),                                          /* a plateau */
                    0.5,                                                                       /* one value */
                    r < 0.5 ? 0.9 : 0.2,                                                       /* two values */
                    0.1 + 0.2 * floor(2.0 + 2.0 * x) / 4.0 + 0.3 * floor(2.0 + 2.0 * y) / 4.0, /* patches */
                    r < 0.7 ? 0.3 + 0.05 * normal() : 0.9, /* noisy cloth before a flat bright ground */
                    0.5 + 0.45 * uniform(),                /* every value as often as the others */
                    bulk,                                  /* half of a bell, whose mode is its end */
                    0.9 + 0.0002 * normal(),               /* hardly any noise */
                    0.2 + 0.7 * (0.5 + 0.5 * x),           /* a ramp */
                };
                for (unsigned c = 0; c < 3; c++) {
                    double v = 60000.0 * fmin(fmax(value[kind] * (1.0 - 0.1 * c), 0.0), 1.05) / step;
                    sample[3 * i + c] = (uint16_t)(fmin(floor(v), floor(65000.0 / step)) * step);
                }
            }
            double share = share_of(state, sample, NULL, 0);
            if (share > 0.0) fail_msg("kind %d, step %u: %g", kind, step, share);
        }
}

/* A wide highlight in a picture of floats, clipped at a value of its own. */
static void test_floats(void **state)
{
    static float pixel[3 * N_PIXEL];
    (void)state;
    for (int clip = 0; clip < 2; clip++) {
        struct photograph_info info = {.saturation = {INFINITY, INFINITY, INFINITY}};
        const struct image im = {EDGE, EDGE, 3, pixel, NULL, NULL};
        for (size_t i = 0; i < 3 * N_PIXEL; i++)
            pixel[i] = (float)fmin(2.0 * exp(0.5 * normal()), clip && i % 3 == 1 ? 3.7 : 1e9);
        saturation_find(&im, &info);
        assert_true(isinf(info.saturation[0]) && isinf(info.saturation[2]));
        assert_true(clip ? (float)info.saturation[1] == 3.7f : isinf(info.saturation[1]));
    }
}

/* Two exposures of 12 bits in 16: the long one is clipped in most places, which the merged picture does not show. */
static void test_merged(void **state)
{
    static uint16_t sample[2][3 * N_PIXEL];
    struct job_exposure longer = {.exposure_s = 0.4};
    struct job_photograph p = photograph_plain(JOB_TRANSFER_LINEAR);
    struct photograph_process process;
    struct photograph_record r;
    struct image im;
    struct error err = {0};
    double mean[3] = {0}, want[3] = {0};
    char folder[1024];
    for (size_t i = 0; i < 3 * N_PIXEL; i++) {
        const double light = 4095.0 * (0.3 + 0.06 * normal()) * (i % 3 == 2 ? 0.5 : 1.0);
        sample[0][i] = (uint16_t)lrint(fmin(fmax(light, 0.0), 4095.0));
        sample[1][i] = (uint16_t)lrint(fmin(fmax(4.0 * light, 0.0), 4095.0));
        want[i % 3] += light / 65535.0 / 0.1 / N_PIXEL;
    }
    stated_write_png(scratch_path(state, "short.png"), EDGE, EDGE, 16, 3, sample[0], NULL, 0);
    stated_write_png(scratch_path(state, "long.png"), EDGE, EDGE, 16, 3, sample[1], NULL, 0);
    snprintf(folder, sizeof folder, "%s", scratch_path(state, ""));
    snprintf(p.file, sizeof p.file, "short.png");
    snprintf(longer.file, sizeof longer.file, "long.png");
    p.exposure_s = 0.1;
    p.n_exposure = 1;
    p.exposure = &longer;
    photograph_process_init(&process);
    if (photograph_develop(&process, folder, &p, &im, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (size_t i = 0; i < 3 * N_PIXEL; i++) mean[i % 3] += (double)im.pixel[i] / N_PIXEL;
    for (int c = 0; c < 3; c++)
        if (!(fabs(mean[c] / want[c] - 1.0) < 2e-3)) fail_msg("channel %d: %g, not %g", c, mean[c], want[c]);
    assert_true(r.saturated_share < 0.001);
    image_release(&im);
    photograph_process_release(&process);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_clipped), cmocka_unit_test(test_any_level),   cmocka_unit_test(test_black_ground),
        cmocka_unit_test(test_stated),  cmocka_unit_test(test_not_clipped), cmocka_unit_test(test_floats),
        cmocka_unit_test(test_merged),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
