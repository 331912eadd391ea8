/* Mean radiances of photographs: exact means, standard errors that include texture, and pictures that must be
 * refused. */
#include "base/rng.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/photographs/rows/observation.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/stated_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void write_exr(const char *path, size_t side, float (*value)(size_t x, size_t y, size_t c))
{
    struct image im;
    assert_int_equal(image_init(&im, side, side, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < side * side; i++)
        for (size_t c = 0; c < 3; c++) im.pixel[3 * i + c] = value(i % side, i / side, c);
    assert_int_equal(image_write_exr(&im, path, NULL), STATUS_OK);
    image_release(&im);
}

static float ramp(size_t x, size_t y, size_t c)
{
    return (float)(c + 1) * (1.0f + 0.001f * (float)x + 0.002f * (float)y);
}
static float red_only(size_t x, size_t y, size_t c) { return (c == 0 ? 0.25f : 0.0f) + 0.0f * (float)(x + y); }
static float green_only(size_t x, size_t y, size_t c) { return (c == 1 ? 0.25f : 0.0f) + 0.0f * (float)(x + y); }
static float blue_only(size_t x, size_t y, size_t c) { return (c == 2 ? 0.25f : 0.0f) + 0.0f * (float)(x + y); }
static float black(size_t x, size_t y, size_t c) { return 0.0f * (float)(x + y + c); }
static float with_nan(size_t x, size_t y, size_t c) { return x == 3 && y == 5 && c == 1 ? NAN : 1.0f; }
static float negative(size_t x, size_t y, size_t c) { return c == 2 ? -0.1f : 0.0f * (float)(x + y) + 1.0f; }
static float edge(size_t x, size_t y, size_t c) { return x < 16 ? 0.01f : 1.0f + 0.0f * (float)(y + c); }

static void test_mean(void **state)
{
    const struct job_photograph whole = {.scale = 2.0}, crop = {.scale = 1.0, .crop_px = {10, 20, 14, 22}};
    struct photograph_mean m;
    const char *path = scratch_path(state, "ramp.exr");
    write_exr(path, 32, ramp);
    assert_int_equal(photograph_measure(path, &whole, &m, NULL), STATUS_OK);
    for (int c = 0; c < 3; c++) assert_true(fabs(m.mean_rgb[c] - 2.0 * (c + 1) * (1.0 + 0.003 * 15.5)) < 1e-6);
    assert_true(m.se_rgb[0] > 0.0 && m.warning[0] == '\0');
    assert_int_equal(photograph_measure(path, &crop, &m, NULL), STATUS_OK);
    assert_true(fabs(m.mean_rgb[0] - (1.0 + 0.001 * 11.5 + 0.002 * 20.5)) < 1e-6);
}

/* Each patch of 4 x 4 pixels has one random value. The standard error of the mean is that of 256 patches, not of 4096
 * pixels. */
static float patches(size_t x, size_t y, size_t c)
{
    struct rng_key key = {.seed = 5};
    struct rng r;
    double z[2];
    rng_start(&r, &key, (uint32_t)(x / 4), (uint32_t)(y / 4));
    rng_normal_pair(&r, z);
    return (float)(1.0 + 0.1 * z[0] + 0.0 * (double)c);
}

static void test_error_of_texture(void **state)
{
    const struct job_photograph whole = {.scale = 1.0};
    struct photograph_mean m;
    const char *path = scratch_path(state, "patches.exr");
    write_exr(path, 64, patches);
    assert_int_equal(photograph_measure(path, &whole, &m, NULL), STATUS_OK);
    double want = 0.1 / 16.0; /* 256 patches; 64 sub-blocks estimate it to 1 / sqrt(126) = 9 % */
    assert_true(fabs(m.se_rgb[0] / want - 1.0) < 4.0 * 0.09);
}

static void check_refused(void **state, const char *name, status code, const char *part)
{
    const struct job_photograph p = {.scale = 1.0};
    struct photograph_mean m;
    struct error err = {0};
    assert_int_equal(photograph_measure(scratch_path(state, name), &p, &m, &err), code);
    if (strstr(err.text, name) == NULL || strstr(err.text, part) == NULL)
        fail_msg("'%s' is not in '%s'", part, err.text);
}

static void test_refused(void **state)
{
    write_exr(scratch_path(state, "black.exr"), 16, black);
    write_exr(scratch_path(state, "nan.exr"), 16, with_nan);
    write_exr(scratch_path(state, "negative.exr"), 16, negative);
    scratch_write(scratch_path(state, "text.exr"), "hello, this is no picture", 25);
    scratch_write(scratch_path(state, "text.png"), "hello, this is no picture", 25);
    scratch_write(scratch_path(state, "picture.gif"), "x", 1);
    check_refused(state, "black.exr", STATUS_INVALID, "all black");
    check_refused(state, "nan.exr", STATUS_INVALID, "pixel (3, 5)");
    check_refused(state, "negative.exr", STATUS_INVALID, "negative");
    check_refused(state, "text.exr", STATUS_FORMAT, "text.exr");
    check_refused(state, "text.png", STATUS_FORMAT, "not a PNG");
    check_refused(state, "picture.gif", STATUS_UNSUPPORTED, "neither OpenEXR");
    const struct job_photograph beyond = {.scale = 1.0, .crop_px = {0, 0, 17, 4}};
    struct photograph_mean m;
    struct error err = {0};
    assert_int_equal(photograph_measure(scratch_path(state, "black.exr"), &beyond, &m, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "(17, 4)"));
}

/* A photograph with light in one channel only is not black. */
static void test_one_channel(void **state)
{
    static float (*const picture[3])(size_t, size_t, size_t) = {red_only, green_only, blue_only};
    for (size_t c = 0; c < 3; c++) {
        const struct job_photograph whole = {.scale = 1.0};
        struct photograph_mean m;
        struct error err = {0};
        write_exr(scratch_path(state, "one.exr"), 16, picture[c]);
        if (photograph_measure(scratch_path(state, "one.exr"), &whole, &m, &err) != STATUS_OK) fail_msg("%s", err.text);
        for (size_t k = 0; k < 3; k++) assert_true(fabs(m.mean_rgb[k] - (k == c ? 0.25 : 0.0)) < 1e-6);
    }
}

static void test_not_uniform(void **state)
{
    const struct job_photograph whole = {.scale = 1.0};
    struct photograph_mean m;
    write_exr(scratch_path(state, "edge.exr"), 32, edge);
    assert_int_equal(photograph_measure(scratch_path(state, "edge.exr"), &whole, &m, NULL), STATUS_OK);
    assert_non_null(strstr(m.warning, "not uniform"));
}

static void test_png(void **state)
{
    uint8_t rgb[16 * 16 * 3];
    struct photograph_mean m;
    struct error err = {0};
    const char *path = scratch_path(state, "grey.png");
    memset(rgb, 128, sizeof rgb);
    for (size_t i = 0; i < 4 * 3; i++) rgb[i] = 255; /* 4 of 256 pixels saturated: 1.6 % */
    stated_write_png_bytes(path, 16, 16, rgb);
    struct job_photograph p = {.scale = 1.0, .transfer = JOB_TRANSFER_SRGB, .crop_px = {0, 1, 16, 16}};
    assert_int_equal(photograph_measure(path, &p, &m, NULL), STATUS_OK);
    assert_true(fabs(m.mean_rgb[1] - pow((128.0 / 255.0 + 0.055) / 1.055, 2.4)) < 1e-6);
    p.transfer = JOB_TRANSFER_LINEAR;
    assert_int_equal(photograph_measure(path, &p, &m, NULL), STATUS_OK);
    assert_true(fabs(m.mean_rgb[1] - 128.0 / 255.0) < 1e-6);
    p.crop_px[1] = 0;
    assert_int_equal(photograph_measure(path, &p, &m, NULL), STATUS_OK);
    assert_true(m.record.saturated_share == 4.0 / 256.0);
    /* saturated pixels count only within the crop: 4 of 16 are too many, but a lamp beside the crop is allowed */
    p.crop_px[2] = p.crop_px[3] = 4;
    assert_int_equal(photograph_measure(path, &p, &m, &err), STATUS_INVALID);
    assert_true(m.record.saturated_share == 0.25);
    memset(rgb + 8 * 16 * 3, 255, 8 * 16 * 3);
    stated_write_png_bytes(path, 16, 16, rgb);
    memcpy(p.crop_px, (size_t[]){0, 1, 16, 8}, sizeof p.crop_px);
    p.scale = 0.25; /* and before the scale */
    assert_int_equal(photograph_measure(path, &p, &m, &err), STATUS_OK);
    assert_true(m.record.saturated_share == 0.0);
    memcpy(p.crop_px, (size_t[]){0, 1, 16, 16}, sizeof p.crop_px);
    p.transfer = JOB_TRANSFER_SRGB;
    memset(rgb, 255, 16 * 3 * 8);
    stated_write_png_bytes(path, 16, 16, rgb);
    assert_int_equal(photograph_measure(path, &p, &m, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "saturated"));
}

/* A photograph with one channel at its largest value is refused, whichever it is, and one just below it is not. */
static void test_one_saturated_channel(void **state)
{
    const struct job_photograph p = photograph_plain(JOB_TRANSFER_LINEAR);
    const char *path = scratch_path(state, "one.png");
    for (size_t c = 0; c < 3; c++)
        for (int below = 0; below < 2; below++) {
            uint8_t rgb[16 * 16 * 3];
            struct photograph_mean m;
            struct error err = {0};
            memset(rgb, 128, sizeof rgb);
            for (size_t i = 0; i < 6; i++) rgb[3 * 40 * i + c] = (uint8_t)(255 - below); /* 6 of 256 pixels: 2.3 % */
            stated_write_png_bytes(path, 16, 16, rgb);
            status s = photograph_measure(path, &p, &m, &err);
            assert_int_equal(s, below ? STATUS_OK : STATUS_INVALID);
            assert_true(m.record.saturated_share == (below ? 0.0 : 6.0 / 256.0));
            if (!below) assert_non_null(strstr(err.text, "saturated"));
        }
}

static void test_truncated_png(void **state)
{
    uint8_t rgb[32 * 32 * 3];
    const struct job_photograph p = photograph_plain(JOB_TRANSFER_LINEAR);
    for (size_t i = 0; i < sizeof rgb; i++) rgb[i] = (uint8_t)(i * 37);
    assert_int_equal(image_write_png_rgb8(rgb, 32, 32, scratch_path(state, "whole.png"), NULL), STATUS_OK);
    size_t n;
    char *bytes = scratch_read(scratch_path(state, "whole.png"), &n);
    for (size_t cut = 0; cut < n; cut += 1 + n / 40) {
        struct photograph_mean m;
        scratch_write(scratch_path(state, "cut.png"), bytes, cut);
        assert_int_not_equal(photograph_measure(scratch_path(state, "cut.png"), &p, &m, NULL), STATUS_OK);
    }
    memcpy(bytes + 16, "\x7f\xff\xff\xff\x7f\xff\xff\xff", 8); /* a header with a wrong size */
    scratch_write(scratch_path(state, "cut.png"), bytes, n);
    struct photograph_mean m;
    assert_int_equal(photograph_measure(scratch_path(state, "cut.png"), &p, &m, NULL), STATUS_TOO_LARGE);
    free(bytes);
}

/* A file of some hundred bytes whose header states hundreds of millions of pixels is refused before memory is
 * allocated. */
static void test_small_files_of_huge_pictures(void **state)
{
    uint8_t rgb[8 * 8 * 3] = {0};
    const struct job_photograph p = {.scale = 1.0};
    struct photograph_mean m;
    struct error err = {0};
    size_t n, at = 0;
    write_exr(scratch_path(state, "small.exr"), 16, ramp);
    char *bytes = scratch_read(scratch_path(state, "small.exr"), &n);
    while (memcmp(bytes + at, "dataWindow", 11) != 0) at++;
    memcpy(bytes + at + 29, "\x5f\xea\0\0\xb7\x0b\0\0",
           8); /* after "box2i", its length and the lower corner: 60000 x 3000 */
    scratch_write(scratch_path(state, "huge.exr"), bytes, n);
    free(bytes);
    assert_int_equal(photograph_measure(scratch_path(state, "huge.exr"), &p, &m, &err), STATUS_FORMAT);
    if (strstr(err.text, "60000 x 3000") == NULL) fail_msg("%s", err.text);
    assert_int_equal(image_write_png_rgb8(rgb, 8, 8, scratch_path(state, "small.png"), NULL), STATUS_OK);
    bytes = scratch_read(scratch_path(state, "small.png"), &n);
    memcpy(bytes + 16, "\0\0\xea\x60\0\0\x0b\xb8", 8);
    scratch_write(scratch_path(state, "huge.png"), bytes, n);
    free(bytes);
    assert_int_equal(photograph_measure(scratch_path(state, "huge.png"), &p, &m, &err), STATUS_FORMAT);
    if (strstr(err.text, "60000 x 3000") == NULL) fail_msg("%s", err.text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mean),
        cmocka_unit_test(test_error_of_texture),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_one_channel),
        cmocka_unit_test(test_not_uniform),
        cmocka_unit_test(test_png),
        cmocka_unit_test(test_one_saturated_channel),
        cmocka_unit_test(test_truncated_png),
        cmocka_unit_test(test_small_files_of_huge_pictures),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
