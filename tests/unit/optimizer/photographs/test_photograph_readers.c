/* The picture readers: exact values of files written here, what they state of the exposure, and files that must be
 * refused with a sentence that names file and reason. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/tools/simulated_camera/dng_file.h"
#include "tests/support/camera_files.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/stated_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

enum { EDGE = 24 };

static const struct job_photograph no_transfer = {
    .scale = 1.0, .exposure_s = NAN, .iso = NAN, .aperture = NAN, .black_level = NAN};

static void read_ok(const char *path, const struct job_photograph *p, struct image *im, struct photograph_record *r)
{
    struct error err = {0};
    if (photograph_read(path, p, im, r, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static void check_refused(const char *path, const struct job_photograph *p, const char *part)
{
    struct photograph_mean m;
    struct error err = {0};
    assert_int_not_equal(photograph_measure(path, p, &m, &err), STATUS_OK);
    const char *name = strrchr(path, '/') + 1;
    if (strstr(err.text, name) == NULL || strstr(err.text, part) == NULL)
        fail_msg("'%s' is not in '%s'", part, err.text);
}

static double srgb(double v) { return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4); }

static void test_tiff_of_every_kind(void **state)
{
    uint8_t *byte = malloc(EDGE * EDGE * 4);
    uint16_t *word = malloc(EDGE * EDGE * 4 * sizeof *word);
    float *real = malloc(EDGE * EDGE * 4 * sizeof *real);
    const struct job_photograph curve = photograph_plain(JOB_TRANSFER_SRGB);
    for (unsigned bits = 8; bits <= 32; bits *= 2)
        for (size_t n = 1; n <= 4; n++)
            for (int layout = 0; layout < 4; layout++) {
                struct camera_tiff t = {
                    EDGE, EDGE, n, bits, .planes = layout % 2 == 1, .deflate = n == 3, .tiled = layout >= 2};
                for (size_t i = 0; i < EDGE * EDGE * n; i++) {
                    bool alpha = n % 2 == 0 && i % n == n - 1;
                    byte[i] = alpha ? 255 : (uint8_t)(i * 7 % 251);
                    word[i] = alpha ? 65535 : (uint16_t)(i * 777 % 65000);
                    real[i] = alpha ? 1.0f : (float)i * 0.01f - 1.0f;
                }
                const char *path = scratch_path(state, "a.tif");
                const void *sample = bits == 8 ? (void *)byte : bits == 16 ? (void *)word : (void *)real;
                struct image im;
                struct photograph_record r;
                camera_write_tiff(path, &t, sample);
                read_ok(path, &curve, &im, &r);
                assert_true(r.info.bits == bits && r.info.has_alpha == (n % 2 == 0) && r.info.encoded == (bits < 32));
                assert_true(r.info.less_trustworthy == (bits < 32) && isnan(r.info.exposure_s));
                for (size_t i = 0; i < EDGE * EDGE * 3; i++) {
                    size_t from = i / 3 * n + (n < 3 ? 0 : i % 3);
                    double want = bits == 8    ? srgb(byte[from] / 255.0)
                                  : bits == 16 ? srgb(word[from] / 65535.0)
                                               : (double)real[from];
                    assert_true(fabs((double)im.pixel[i] - want) < 1e-6);
                }
                image_release(&im);
            }
    free(byte);
    free(word);
    free(real);
}

static void test_tiff_refused(void **state)
{
    static uint8_t byte[EDGE * EDGE * 4];
    const struct job_photograph linear = photograph_plain(JOB_TRANSFER_LINEAR);
    memset(byte, 99, sizeof byte);
    const char *path = scratch_path(state, "bad.tif");
    camera_write_tiff(path, &(struct camera_tiff){EDGE, EDGE, 3, 8}, byte);
    check_refused(path, &no_transfer, "\"transfer\": \"srgb\"");
    camera_write_tiff(path, &(struct camera_tiff){EDGE, EDGE, 4, 8}, byte);
    check_refused(path, &linear, "transparent");
    camera_write_tiff(path, &(struct camera_tiff){EDGE, EDGE, 1, 8, .palette = true}, byte);
    check_refused(path, &linear, "palette");
    camera_write_tiff(path, &(struct camera_tiff){EDGE, EDGE, 3, 32}, (float[EDGE * EDGE * 3]){1.0f});
    check_refused(path, &(struct job_photograph){.scale = 1.0, .transfer = JOB_TRANSFER_SRGB}, "is linear");
    camera_write_tiff(path, &(struct camera_tiff){EDGE, EDGE, 3, 8}, byte);
    size_t n;
    char *whole = scratch_read(path, &n);
    for (size_t cut = 0; cut + 1 < n; cut += 1 + n / 50) {
        scratch_write(path, whole, cut);
        check_refused(path, &linear, "cannot read");
    }
    free(whole);
    const char *wrong = scratch_path(state, "picture.png");
    camera_write_tiff(wrong, &(struct camera_tiff){EDGE, EDGE, 3, 8}, byte);
    check_refused(wrong, &linear, "it is a TIFF file");
}

static void test_exif_of_tiff(void **state)
{
    static uint16_t word[EDGE * EDGE * 3];
    struct job_photograph p = photograph_plain(JOB_TRANSFER_LINEAR);
    struct image im;
    struct photograph_record r;
    for (size_t i = 0; i < EDGE * EDGE * 3; i++) word[i] = 6553;
    const char *path = scratch_path(state, "exif.tif");
    camera_write_tiff(path, &(struct camera_tiff){EDGE, EDGE, 3, 16, .exposure_s = 0.25, .iso = 400, .aperture = 8},
                      word);
    read_ok(path, &p, &im, &r);
    assert_true(r.info.exposure_s == 0.25 && r.info.iso == 400.0 && r.info.aperture == 8.0);
    assert_true(fabs((double)im.pixel[5] / (6553.0 / 65535.0 * 64.0) - 1.0) < 1e-6);
    image_release(&im);
    p.exposure_s = 0.5; /* the document overrides the file */
    p.black_level = 553.0;
    read_ok(path, &p, &im, &r);
    assert_true(r.info.exposure_s == 0.5 && r.info.black_level == 553.0);
    assert_true(fabs((double)im.pixel[5] / (6000.0 / (65535.0 - 553.0) * 32.0) - 1.0) < 1e-6);
    image_release(&im);
    p.transfer = JOB_TRANSFER_SRGB;
    check_refused(path, &p, "black level");
}

static void test_jpeg(void **state)
{
    static uint8_t rgb[EDGE * EDGE * 3];
    struct job_photograph p = photograph_plain(JOB_TRANSFER_SRGB);
    struct image im;
    struct photograph_record r;
    for (size_t i = 0; i < sizeof rgb; i++) rgb[i] = (uint8_t)(i % 3 == 0 ? 200 : i % 3 == 1 ? 120 : 40);
    const char *path = scratch_path(state, "a.jpg");
    camera_write_jpeg(path, EDGE, EDGE, rgb, 0.0);
    read_ok(path, &p, &im, &r);
    assert_true(r.info.less_trustworthy && r.info.bits == 8 && r.exposure == 1.0);
    for (size_t c = 0; c < 3; c++)
        assert_true(fabs((double)im.pixel[c] - srgb(rgb[c] / 255.0)) <
                    0.02); /* one of 255 steps, from the color space */
    image_release(&im);
    check_refused(path, &no_transfer, "JPEG of 8 bits");
    camera_write_jpeg(path, EDGE, EDGE, rgb, 0.02);
    read_ok(path, &p, &im, &r);
    assert_true(fabs(r.info.exposure_s - 0.02) < 1e-9 && r.info.iso == 200.0 && r.info.aperture == 8.0);
    assert_true(fabs(r.exposure / (0.02 * 2.0 / 64.0) - 1.0) < 1e-9);
    image_release(&im);
    size_t n;
    char *whole = scratch_read(path, &n);
    for (size_t cut = 0; cut + 8 < n; cut += 1 + n / 60) { /* the last bytes are the end marker and padding */
        scratch_write(path, whole, cut);
        check_refused(path, &p, "cannot read");
    }
    free(whole);
}

/* Mosaic value of a pixel: black 512, and a value of its own for each place of the cell. */
static void test_dng(void **state)
{
    static uint16_t mosaic[32 * 32];
    struct image im;
    struct photograph_record r;
    for (size_t y = 0; y < 32; y++)
        for (size_t x = 0; x < 32; x++)
            mosaic[y * 32 + x] =
                (uint16_t)(512 + (y % 2 == 0 ? (x % 2 == 0 ? 1000u : 2000u) : (x % 2 == 0 ? 2200u : 500u)) +
                           10 * (x / 2));
    mosaic[0] = 500;            /* below black, by noise */
    mosaic[2 * 32 + 4] = 16383; /* saturated */
    const char *path = scratch_path(state, "a.dng");
    assert_int_equal(dng_file_write(path, &(struct dng_picture){32, 32, 512, 16383, 0.5, 100, 4}, mosaic, NULL),
                     STATUS_OK);
    read_ok(path, &no_transfer, &im, &r);
    assert_true(im.width == 16 && im.height == 16 && r.info.black_level == 512.0 && r.info.full_scale == 15871.0);
    assert_true(!r.info.less_trustworthy && r.info.bits == 14 && strstr(r.info.camera, "Test camera") != NULL);
    assert_true(r.info.exposure_s == 0.5 && r.info.iso == 100.0 && r.info.aperture == 4.0);
    double unit = 0.5 / 16.0 * 15871.0;
    const float *p = im.pixel + 3 * (16 * 5 + 7);
    assert_true(fabs((double)p[0] * unit - 1070.0) < 0.01 && fabs((double)p[1] * unit - 2170.0) < 0.01 &&
                fabs((double)p[2] * unit - 570.0) < 0.01);
    assert_true(fabs((double)im.pixel[0] * unit + 12.0) < 0.01); /* not clamped */
    assert_true(r.saturated_share == 1.0 / 256.0);
    image_release(&im);
    struct job_photograph other = no_transfer;
    other.black_level = 500.0;
    read_ok(path, &other, &im, &r);
    assert_true(fabs((double)im.pixel[0]) < 1e-6);
    image_release(&im);
    other.black_level = 16383.0;
    check_refused(path, &other, "its black level 16383 is not below its white level 16383");
    size_t n;
    char *whole = scratch_read(path, &n);
    scratch_write(path, whole, n / 3);
    check_refused(path, &no_transfer, "LibRaw says");
    free(whole);
}

/* A black level for each place of 4 x 4 samples, of which the first is 0. */
static void test_black_of_places(void **state)
{
    static uint16_t mosaic[32 * 32];
    float black[16];
    const uint16_t repeat[2] = {4, 4};
    const char *path = scratch_path(state, "places.dng");
    struct image im;
    struct photograph_record r;
    for (size_t i = 0; i < 16; i++) black[i] = 10.0f * (float)i;
    for (size_t i = 0; i < 32 * 32; i++) mosaic[i] = (uint16_t)(1000 + 10 * (i / 32 % 4 * 4 + i % 4));
    assert_int_equal(dng_file_write(path, &(struct dng_picture){32, 32, 0, 16383, 0, 0, 0}, mosaic, NULL), STATUS_OK);
    TIFF *tiff = TIFFOpen(path, "r+");
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_BLACKLEVELREPEATDIM, repeat);
    TIFFSetField(tiff, TIFFTAG_BLACKLEVEL, 16, black);
    assert_int_equal(TIFFRewriteDirectory(tiff), 1);
    TIFFClose(tiff);
    read_ok(path, &no_transfer, &im, &r);
    for (size_t i = 0; i < 16 * 16 * 3; i++) assert_true(fabs((double)im.pixel[i] * r.info.full_scale - 1000.0) < 0.01);
    image_release(&im);
}

/* A raw file is turned as it says, as viewers show it. */
static void test_turned_dng(void **state)
{
    static uint16_t mosaic[40 * 24];
    const char *path = scratch_path(state, "turned.dng");
    for (size_t i = 0; i < 40 * 24; i++) mosaic[i] = (uint16_t)(1000 + 100 * (i % 40 / 2) + 7 * (i / 80));
    for (uint16_t k = 1; k <= 8; k++) {
        struct image im;
        struct photograph_record r;
        assert_int_equal(dng_file_write(path, &(struct dng_picture){40, 24, 0, 16383, 0, 0, 0}, mosaic, NULL),
                         STATUS_OK);
        TIFF *tiff = TIFFOpen(path, "r+");
        assert_non_null(tiff);
        TIFFSetField(tiff, TIFFTAG_ORIENTATION, k);
        assert_int_equal(TIFFRewriteDirectory(tiff), 1);
        TIFFClose(tiff);
        read_ok(path, &no_transfer, &im, &r);
        assert_true(r.info.orientation == k && im.width == (k < 5 ? 20 : 12) && im.height == (k < 5 ? 12 : 20));
        const bool from_right[9] = {0, 0, 1, 1, 0, 0, 0, 1, 1}, from_below[9] = {0, 0, 0, 1, 1, 0, 1, 1, 0};
        /* the red sample lies in the upper left of the cell as it is in the file */
        const bool flip[2] = {k < 5 ? from_right[k] : from_below[k], k < 5 ? from_below[k] : from_right[k]};
        for (size_t a = 0; a < 2; a++) {
            assert_true(r.info.sample_px[0][a] == (flip[a] ? 0.25 : -0.25) && r.info.sample_px[1][a] == 0.0);
            assert_true(r.info.sample_px[2][a] == -r.info.sample_px[0][a]);
        }
        for (size_t y = 0; y < im.height; y++)
            for (size_t x = 0; x < im.width; x++) { /* of a column or row from 5 on, rows and columns are exchanged */
                size_t column = k < 5 ? x : y, row = k < 5 ? y : x;
                if (from_right[k]) column = 19 - column;
                if (from_below[k]) row = 11 - row;
                assert_true(fabs((double)im.pixel[3 * (y * im.width + x)] * 16383.0 -
                                 (double)(1000 + 100 * column + 7 * row)) < 0.01);
            }
        image_release(&im);
    }
}

static void test_files_that_are_missing(void **state)
{
    static const char *const name[] = {"none.png", "none.jpg", "none.tif", "none.exr", "none.dng"};
    for (size_t i = 0; i < sizeof name / sizeof *name; i++) {
        struct job_photograph p = no_transfer;
        p.transfer = i < 2 ? JOB_TRANSFER_SRGB : i == 2 ? JOB_TRANSFER_LINEAR : no_transfer.transfer;
        check_refused(scratch_path(state, name[i]), &p, "cannot read photograph");
    }
}

/* A black level is taken from every value of an EXR picture. */
static void test_black_of_exr(void **state)
{
    const char *path = scratch_path(state, "a.exr");
    struct image im;
    struct photograph_record r;
    struct job_photograph p = no_transfer;
    p.black_level = 0.25;
    assert_int_equal(image_init(&im, EDGE, EDGE, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < EDGE * EDGE * 3; i++) im.pixel[i] = 0.5f + (float)(i % 256) / 256.0f;
    assert_int_equal(image_write_exr(&im, path, NULL), STATUS_OK);
    image_release(&im);
    read_ok(path, &p, &im, &r);
    for (size_t i = 0; i < EDGE * EDGE * 3; i++)
        assert_true(fabs((double)im.pixel[i] - 0.25 - (double)(i % 256) / 256.0) < 1e-3);
    image_release(&im);
}

/* The Kodak DC50 of data/camera-raw (LibRaw's sample, by way of rawpy's test data). */
static void test_real_raw(void **state)
{
    char path[4096];
    const char *data = getenv("SELVEDGE_DATA");
    struct image im;
    struct photograph_record r;
    (void)state;
    snprintf(path, sizeof path, "%s/camera-raw/RAW_KODAK_DC50.KDC", data != NULL ? data : "../shared/data");
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        printf("skipped: no %s\n", path);
        skip();
    }
    fclose(file);
    read_ok(path, &no_transfer, &im, &r);
    assert_true(im.width == 768 / 2 && im.height == 512 / 2 && strstr(r.info.camera, "DC50") != NULL);
    double mean[3] = {0};
    for (size_t i = 0; i < im.width * im.height * 3; i++) {
        assert_true(isfinite(im.pixel[i]));
        mean[i % 3] += (double)im.pixel[i] / (double)(im.width * im.height);
    }
    assert_true(mean[0] > 0.0 && mean[1] > 0.0 && mean[2] > 0.0 && r.saturated_share < 0.5);
    image_release(&im);
}

/* Neighbouring pixels of an enlarged picture hardly differ. */
static void test_enlarged(void **state)
{
    enum { SMALL = 40, LARGE = 2 * SMALL };
    static uint8_t small[SMALL * SMALL], byte[LARGE * LARGE * 3];
    const struct job_photograph p = photograph_plain(JOB_TRANSFER_LINEAR);
    struct photograph_mean m;
    unsigned noise = 1;
    for (size_t i = 0; i < SMALL * SMALL; i++)
        small[i] = (uint8_t)(100 + (noise = noise * 1103515245u + 12345u) / 65536 % 50);
    for (size_t y = 0; y < LARGE; y++)
        for (size_t x = 0; x < LARGE; x++) {
            double fx = fmin(fmax((double)x / 2.0 - 0.25, 0.0), SMALL - 1.001),
                   fy = fmin(fmax((double)y / 2.0 - 0.25, 0.0), SMALL - 1.001);
            size_t ix = (size_t)fx, iy = (size_t)fy;
            double ax = fx - (double)ix, ay = fy - (double)iy;
            const uint8_t *s = small + iy * SMALL + ix;
            double v = (1 - ay) * ((1 - ax) * s[0] + ax * s[1]) + ay * ((1 - ax) * s[SMALL] + ax * s[SMALL + 1]);
            for (size_t c = 0; c < 3; c++) byte[(y * LARGE + x) * 3 + c] = (uint8_t)lrint(v);
        }
    const char *path = scratch_path(state, "large.png");
    stated_write_png_bytes(path, LARGE, LARGE, byte);
    assert_int_equal(photograph_measure(path, &p, &m, NULL), STATUS_OK);
    assert_true(m.record.resampled && strstr(m.warning, "large.png") != NULL && strstr(m.warning, "enlarged") != NULL);
    for (size_t i = 0; i < SMALL * SMALL * 3; i++) byte[i] = small[i / 3];
    stated_write_png_bytes(path, SMALL, SMALL, byte);
    assert_int_equal(photograph_measure(path, &p, &m, NULL), STATUS_OK);
    assert_true(!m.record.resampled && m.warning[0] == '\0');
    stated_write_png_bytes(path, 8, 8, byte);
    assert_int_equal(photograph_measure(path, &p, &m, NULL), STATUS_OK);
    assert_non_null(strstr(m.warning, "8 x 8"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_tiff_of_every_kind),
        cmocka_unit_test(test_tiff_refused),
        cmocka_unit_test(test_exif_of_tiff),
        cmocka_unit_test(test_jpeg),
        cmocka_unit_test(test_dng),
        cmocka_unit_test(test_black_of_places),
        cmocka_unit_test(test_turned_dng),
        cmocka_unit_test(test_black_of_exr),
        cmocka_unit_test(test_files_that_are_missing),
        cmocka_unit_test(test_real_raw),
        cmocka_unit_test(test_enlarged),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
