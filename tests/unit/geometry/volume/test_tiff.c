/* TIFF volumes: which kinds of samples, layouts and stacks are read. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/format/volume_source.h"
#include "tests/support/scan/tiff_stack.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

static void test_kinds(void **state)
{
    (void)state;
    static const uint16_t bits[] = {8, 16, 32},
                          compression[] = {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE};
    char path[128];
    const char *list[1] = {path};
    stack_path(path, "stack.tif");
    for (size_t b = 0; b < 3; b++)
        for (size_t c = 0; c < 3; c++)
            for (int layout = TEST_STRIPS; layout <= TEST_TILES; layout++) {
                stack_write(path, bits[b], STACK_PAGES, compression[c], (enum test_tiff_layout)layout);
                stack_check(list, 1, bits[b]);
            }
}

struct sample_kind {
    uint16_t format, bits;
    double value[4]; /* at the edges of its range */
};

/* The four values as the bytes of a row of pixels. */
static void encode(const struct sample_kind *kind, void *row)
{
    uint8_t *at = row;
    for (size_t i = 0; i < 4; i++, at += kind->bits / 8) {
        double x = kind->value[i];
        if (kind->format == SAMPLEFORMAT_IEEEFP && kind->bits == 64) memcpy(at, &x, 8);
        if (kind->format == SAMPLEFORMAT_IEEEFP && kind->bits == 32) memcpy(at, &(float){(float)x}, 4);
        if (kind->format == SAMPLEFORMAT_INT) memcpy(at, &(int32_t){(int32_t)x}, kind->bits / 8); /* little-endian */
        if (kind->format == SAMPLEFORMAT_UINT) memcpy(at, &(uint32_t){(uint32_t)x}, kind->bits / 8);
    }
}

static void write_kind(const char *path, const struct sample_kind *kind)
{
    uint8_t row[32];
    TIFF *t = TIFFOpen(path, "w");
    assert_non_null(t);
    encode(kind, row);
    TIFFSetField(t, TIFFTAG_IMAGEWIDTH, 4u);
    TIFFSetField(t, TIFFTAG_IMAGELENGTH, 1u);
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, kind->bits);
    TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, kind->format);
    TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, 1u);
    TIFFWriteEncodedStrip(t, 0, row, 4 * kind->bits / 8);
    TIFFClose(t);
}

static void test_sample_types(void **state)
{
    (void)state;
    static const struct sample_kind kind[] = {{SAMPLEFORMAT_UINT, 8, {0, 1, 200, 255}},
                                              {SAMPLEFORMAT_UINT, 16, {0, 1, 40000, 65535}},
                                              {SAMPLEFORMAT_UINT, 32, {0, 1, 3000000000.0, 4294967040.0}},
                                              {SAMPLEFORMAT_INT, 8, {-128, -1, 0, 127}},
                                              {SAMPLEFORMAT_INT, 16, {-32768, -1, 0, 32767}},
                                              {SAMPLEFORMAT_INT, 32, {-2147483648.0, -1, 0, 2000000000.0}},
                                              {SAMPLEFORMAT_IEEEFP, 32, {-1.5, 0, 0.25, 1e30}},
                                              {SAMPLEFORMAT_IEEEFP, 64, {-1.5, 0, 0.25, 1e30}}};
    char path[128];
    const char *list[1] = {path};
    stack_path(path, "kind.tif");
    for (size_t k = 0; k < sizeof kind / sizeof kind[0]; k++) {
        struct volume_source *source;
        float value[4];
        write_kind(path, &kind[k]);
        assert_int_equal(volume_source_open(list, 1, &source, NULL), STATUS_OK);
        assert_int_equal(volume_source_read(source, 0, 1, value, NULL), STATUS_OK);
        for (size_t i = 0; i < 4; i++) assert_true(value[i] == (float)kind[k].value[i]);
        volume_source_close(source);
    }
}

static void test_kind_of_sample_that_is_none(void **state)
{
    (void)state;
    char path[128];
    stack_path(path, "twelve.tif");
    stack_write(path, 16, 1, COMPRESSION_NONE, TEST_STRIPS);
    TIFF *t = TIFFOpen(path, "r+");
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 12);
    TIFFRewriteDirectory(t);
    TIFFClose(t);
    stack_expect_open_error(path, STATUS_UNSUPPORTED, "12-bit samples of an unsupported kind");
}

static void test_slices(void **state)
{
    (void)state;
    char path[STACK_PAGES][128], name[32];
    const char *list[STACK_PAGES];
    for (size_t i = 0; i < STACK_PAGES; i++) {
        snprintf(name, sizeof name, "slice%zu.tif", i);
        stack_path(path[i], name);
        list[i] = path[i];
        struct test_page page = {STACK_WIDTH, STACK_HEIGHT, 16, stack_pixels(i, 16)};
        test_write_tiff(path[i], &page, 1, COMPRESSION_NONE, TEST_STRIPS);
        free((void *)(uintptr_t)page.pixel);
    }
    stack_check(list, STACK_PAGES, 16);
    test_write_bytes(path[2], "", 0); /* a slice of 0 bytes */
    struct error err = {0};
    struct volume_source *s;
    assert_int_equal(volume_source_open(list, STACK_PAGES, &s, &err), STATUS_FORMAT);
    assert_string_equal(err.text, "cannot read volume 'slice2.tif': the file is empty");
    assert_string_equal(err.field, OPTION_SCAN_FILES);
}

/* A slice without material is compressed to a few bytes by these codecs. */
static void test_constant_slices(void **state)
{
    (void)state;
    enum { EDGE = 1024 };
    static const uint16_t compression[] = {COMPRESSION_ADOBE_DEFLATE, COMPRESSION_LZW, COMPRESSION_LZMA,
                                           COMPRESSION_ZSTD, COMPRESSION_LERC};
    static uint16_t pixel[EDGE * EDGE];
    static float value[EDGE * EDGE];
    char path[128];
    const char *list[1] = {path};
    stack_path(path, "constant.tif");
    for (size_t i = 0; i < EDGE * EDGE; i++) pixel[i] = 513;
    for (size_t c = 0; c < sizeof compression / sizeof compression[0]; c++) {
        struct error err = {0};
        struct volume_source *s = NULL;
        if (!TIFFIsCODECConfigured(compression[c])) continue;
        TIFF *t = TIFFOpen(path, "w");
        TIFFSetField(t, TIFFTAG_IMAGEWIDTH, EDGE);
        TIFFSetField(t, TIFFTAG_IMAGELENGTH, EDGE);
        TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 16);
        TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, EDGE); /* one strip */
        TIFFSetField(t, TIFFTAG_COMPRESSION, compression[c]);
        assert_int_equal(TIFFWriteEncodedStrip(t, 0, pixel, sizeof pixel), sizeof pixel);
        TIFFClose(t);
        if (volume_source_open(list, 1, &s, &err) != STATUS_OK)
            fail_msg("compression %u: %s", compression[c], err.text);
        assert_int_equal(volume_source_read(s, 0, 1, value, &err), STATUS_OK);
        for (size_t i = 0; i < EDGE * EDGE; i++) assert_true(value[i] == 513.0f);
        volume_source_close(s);
    }
}

/* Values of such a file decrease with density. They must neither be used as they are nor be inverted without notice. */
static void test_white_is_zero(void **state)
{
    (void)state;
    static uint8_t data[1 << 16];
    char path[128];
    stack_path(path, "white.tif");
    stack_write(path, 16, 1, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data);
    tiff_patch_tag(data, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISWHITE);
    test_write_bytes(path, data, n);
    stack_expect_open_error(
        path, STATUS_UNSUPPORTED,
        "page 1 has PhotometricInterpretation 0 (white is zero): save the stack with black as zero");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kinds),
        cmocka_unit_test(test_sample_types),
        cmocka_unit_test(test_kind_of_sample_that_is_none),
        cmocka_unit_test(test_slices),
        cmocka_unit_test(test_constant_slices),
        cmocka_unit_test(test_white_is_zero),
    };
    return cmocka_run_group_tests(tests, stack_folder_setup, NULL);
}
