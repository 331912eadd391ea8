/* TIFF volumes: what is read, and the errors of files that are not what they claim to be. */
#include "base/option_id.h"
#include "geometry/reconstruct.h"
#include "geometry/volume/volume_source.h"
#include "tests/support/cloth/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>
#include <unistd.h>

#include <cmocka.h>

enum { W = 37, H = 23, N = 4 };

static char folder[64];

static void path_of(char path[128], const char *name) { snprintf(path, 128, "%s/%s", folder, name); }

static int make_folder(void **state)
{
    (void)state;
    test_make_folder(folder);
    return 0;
}

static float expected(size_t page, size_t i, uint16_t bits)
{
    size_t x = (page * 7919u + i * 31u) % (bits == 8 ? 251u : 65521u);
    return bits == 32 ? (float)x * 0.25f - 3.0f : (float)x;
}

static void *make_pixels(size_t page, uint16_t bits)
{
    uint8_t *p = malloc((size_t)W * H * 4);
    for (size_t i = 0; i < W * H; i++) {
        float x = expected(page, i, bits);
        uint16_t u16 = (uint16_t)(bits == 32 ? 0.0f : x);
        if (bits == 8) p[i] = (uint8_t)x;
        if (bits == 16) memcpy(p + 2 * i, &u16, 2);
        if (bits == 32) memcpy(p + 4 * i, &x, 4);
    }
    return p;
}

static void write_stack(const char *path, uint16_t bits, size_t n_page, uint16_t compression,
                        enum test_tiff_layout layout)
{
    struct test_page page[N];
    for (size_t i = 0; i < n_page; i++) page[i] = (struct test_page){W, H, bits, make_pixels(i, bits)};
    test_write_tiff(path, page, n_page, compression, layout);
    for (size_t i = 0; i < n_page; i++) free((void *)(uintptr_t)page[i].pixel);
}

static void check_stack(const char *const *path, size_t n_path, uint16_t bits)
{
    struct error err = {0};
    struct volume_source *s;
    float value[2 * W * H];
    assert_int_equal(volume_source_open(path, n_path, &s, &err), STATUS_OK);
    assert_int_equal(volume_source_describe(s)->n[0], W);
    assert_int_equal(volume_source_describe(s)->n[1], H);
    assert_int_equal(volume_source_describe(s)->n[2], N);
    for (int from = 2; from >= 0; from -= 2) { /* backwards, too */
        assert_int_equal(volume_source_read(s, (size_t)from, 2, value, &err), STATUS_OK);
        for (size_t i = 0; i < 2 * W * H; i++)
            assert_true(value[i] == expected((size_t)from + i / (W * H), i % (W * H), bits));
    }
    assert_int_equal(volume_source_read(s, 3, 2, value, &err), STATUS_INTERNAL);
    volume_source_close(s);
}

static void test_kinds(void **state)
{
    (void)state;
    static const uint16_t bits[] = {8, 16, 32},
                          compression[] = {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE};
    char path[128];
    const char *list[1] = {path};
    path_of(path, "stack.tif");
    for (size_t b = 0; b < 3; b++)
        for (size_t c = 0; c < 3; c++)
            for (int layout = TEST_STRIPS; layout <= TEST_TILES; layout++) {
                write_stack(path, bits[b], N, compression[c], (enum test_tiff_layout)layout);
                check_stack(list, 1, bits[b]);
            }
}

static void expect_open_error(const char *path, status code, const char *text)
{
    struct error err = {0};
    struct volume_source *s = NULL;
    if (volume_source_open(&path, 1, &s, &err) != code) fail_msg("%s: %s", status_name(err.code), err.text);
    assert_null(s);
    if (strstr(err.text, text) == NULL) fail_msg("'%s' lacks '%s'", err.text, text);
    assert_string_equal(err.field, OPTION_SCAN_FILES);
}

/* Every kind of sample, with values at the edges of its range; kinds that are none are refused. */
static void test_sample_types(void **state)
{
    (void)state;
    static const struct {
        uint16_t format, bits;
        double value[4];
    } kind[] = {{SAMPLEFORMAT_UINT, 8, {0, 1, 200, 255}},
                {SAMPLEFORMAT_UINT, 16, {0, 1, 40000, 65535}},
                {SAMPLEFORMAT_UINT, 32, {0, 1, 3000000000.0, 4294967040.0}},
                {SAMPLEFORMAT_INT, 8, {-128, -1, 0, 127}},
                {SAMPLEFORMAT_INT, 16, {-32768, -1, 0, 32767}},
                {SAMPLEFORMAT_INT, 32, {-2147483648.0, -1, 0, 2000000000.0}},
                {SAMPLEFORMAT_IEEEFP, 32, {-1.5, 0, 0.25, 1e30}},
                {SAMPLEFORMAT_IEEEFP, 64, {-1.5, 0, 0.25, 1e30}}};
    char path[128];
    const char *list[1] = {path};
    path_of(path, "kind.tif");
    for (size_t k = 0; k < sizeof kind / sizeof kind[0]; k++) {
        union {
            uint8_t u8[4];
            int8_t i8[4];
            uint16_t u16[4];
            int16_t i16[4];
            uint32_t u32[4];
            int32_t i32[4];
            float f32[4];
            double f64[4];
        } pixel;
        for (size_t i = 0; i < 4; i++) {
            double x = kind[k].value[i];
            bool is_int = kind[k].format == SAMPLEFORMAT_INT;
            if (kind[k].format == SAMPLEFORMAT_IEEEFP && kind[k].bits == 64)
                pixel.f64[i] = x;
            else if (kind[k].format == SAMPLEFORMAT_IEEEFP)
                pixel.f32[i] = (float)x;
            else if (kind[k].bits == 8 && is_int)
                pixel.i8[i] = (int8_t)x;
            else if (kind[k].bits == 8)
                pixel.u8[i] = (uint8_t)x;
            else if (kind[k].bits == 16 && is_int)
                pixel.i16[i] = (int16_t)x;
            else if (kind[k].bits == 16)
                pixel.u16[i] = (uint16_t)x;
            else if (is_int)
                pixel.i32[i] = (int32_t)x;
            else
                pixel.u32[i] = (uint32_t)x;
        }
        TIFF *t = TIFFOpen(path, "w");
        assert_non_null(t);
        TIFFSetField(t, TIFFTAG_IMAGEWIDTH, 4u);
        TIFFSetField(t, TIFFTAG_IMAGELENGTH, 1u);
        TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, kind[k].bits);
        TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, kind[k].format);
        TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, 1u);
        TIFFWriteEncodedStrip(t, 0, &pixel, 4 * kind[k].bits / 8);
        TIFFClose(t);
        struct volume_source *source;
        float value[4];
        assert_int_equal(volume_source_open(list, 1, &source, NULL), STATUS_OK);
        assert_int_equal(volume_source_read(source, 0, 1, value, NULL), STATUS_OK);
        for (size_t i = 0; i < 4; i++) assert_true(value[i] == (float)kind[k].value[i]);
        volume_source_close(source);
    }
    write_stack(path, 16, 1, COMPRESSION_NONE, TEST_STRIPS);
    TIFF *t = TIFFOpen(path, "r+");
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 12);
    TIFFRewriteDirectory(t);
    TIFFClose(t);
    expect_open_error(path, STATUS_UNSUPPORTED, "12-bit samples of an unsupported kind");
}

static void test_slices(void **state)
{
    (void)state;
    char path[N][128], name[32];
    const char *list[N];
    for (size_t i = 0; i < N; i++) {
        snprintf(name, sizeof name, "slice%zu.tif", i);
        path_of(path[i], name);
        list[i] = path[i];
        struct test_page page = {W, H, 16, make_pixels(i, 16)};
        test_write_tiff(path[i], &page, 1, COMPRESSION_NONE, TEST_STRIPS);
        free((void *)(uintptr_t)page.pixel);
    }
    check_stack(list, N, 16);
    test_write_bytes(path[2], "", 0); /* a slice of 0 bytes */
    struct error err = {0};
    struct volume_source *s;
    assert_int_equal(volume_source_open(list, N, &s, &err), STATUS_FORMAT);
    assert_string_equal(err.text, "cannot read volume 'slice2.tif': the file is empty");
    assert_string_equal(err.field, OPTION_SCAN_FILES);
}

static void test_unlike_pages(void **state)
{
    (void)state;
    char path[128];
    void *p8 = make_pixels(0, 8), *p16 = make_pixels(0, 16), *p32 = make_pixels(0, 32);
    path_of(path, "silk.tif");
    struct test_page depth[3] = {{W, H, 16, p16}, {W, H, 16, p16}, {W, H, 8, p8}};
    test_write_tiff(path, depth, 3, COMPRESSION_NONE, TEST_STRIPS);
    expect_open_error(path, STATUS_FORMAT, "cannot read volume 'silk.tif': page 3 is 8-bit, page 1 is 16-bit");
    struct test_page size[2] = {{W, H, 16, p16}, {W, H - 1, 16, p16}};
    test_write_tiff(path, size, 2, COMPRESSION_NONE, TEST_STRIPS);
    expect_open_error(path, STATUS_FORMAT, "page 2 has 37 x 22 pixels, page 1 has 37 x 23");
    free(p8);
    free(p16);
    free(p32);
}

static size_t read_file(const char *path, uint8_t *data, size_t room)
{
    FILE *f = fopen(path, "rb");
    size_t n = fread(data, 1, room, f);
    fclose(f);
    return n;
}

/* Cut at every place: an error, never a crash, never silence about missing data. */
static void test_truncated(void **state)
{
    (void)state;
    char path[128];
    static uint8_t data[1 << 16];
    const char *list[1] = {path};
    path_of(path, "cut.tif");
    write_stack(path, 16, N, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = read_file(path, data, sizeof data);
    for (size_t keep = 0; keep < n; keep += 61) {
        struct error err = {0};
        struct volume_source *s = NULL;
        test_write_bytes(path, data, keep);
        assert_int_not_equal(volume_source_open(list, 1, &s, &err), STATUS_OK);
        assert_true(strlen(err.text) > 20);
    }
}

/* Flipped bytes: any outcome but a crash or an unlimited allocation. */
static void test_damaged(void **state)
{
    (void)state;
    char path[128];
    static uint8_t data[1 << 16];
    static float value[W * H * N];
    const char *list[1] = {path};
    path_of(path, "damaged.tif");
    write_stack(path, 16, N, COMPRESSION_ADOBE_DEFLATE, TEST_STRIPS);
    size_t n = read_file(path, data, sizeof data);
    for (size_t i = 0; i < n; i += 7) {
        struct error err = {0};
        struct volume_source *s = NULL;
        data[i] ^= 0xff;
        test_write_bytes(path, data, n);
        if (volume_source_open(list, 1, &s, &err) == STATUS_OK) {
            const size_t *shape = volume_source_describe(s)->n;
            if (shape[0] * shape[1] * shape[2] <= W * H * N) volume_source_read(s, 0, shape[2], value, &err);
            volume_source_close(s);
        }
        data[i] ^= 0xff;
    }
}

/* Overwrites the value of a tag in the first directory of a little-endian file with 32-bit offsets. */
static void patch_tag(uint8_t *data, uint16_t tag, uint32_t value)
{
    uint32_t at;
    uint16_t n, id, type = 4;
    memcpy(&at, data + 4, 4);
    memcpy(&n, data + at, 2);
    for (uint8_t *e = data + at + 2; n > 0; n--, e += 12) {
        memcpy(&id, e, 2);
        if (id != tag) continue;
        memcpy(e + 2, &type, 2);
        memcpy(e + 4, &(uint32_t){1}, 4);
        memcpy(e + 8, &value, 4);
        return;
    }
    fail_msg("tag %u not found", tag);
}

static void test_lying_header(void **state)
{
    (void)state;
    char path[128];
    static uint8_t data[1 << 16];
    path_of(path, "liar.tif");
    write_stack(path, 8, 1, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = read_file(path, data, sizeof data);
    patch_tag(data, TIFFTAG_IMAGEWIDTH, 400000);
    test_write_bytes(path, data, n);
    expect_open_error(path, STATUS_FORMAT, "cannot read volume 'liar.tif': page 1 promises 400000 x 23 pixels");
}

/* Sums of rows of such a page wrap around. Little need be stored for it: deflate may shrink it a thousandfold. */
static void test_enormous_pages(void **state)
{
    (void)state;
    static const uint32_t edge[][2] = {{1, 3000000000u}, {3000000000u, 1}, {(1u << 20) + 1, H}};
    const uint32_t stored = 8u << 20;
    static uint8_t data[1 << 16];
    char path[128];
    path_of(path, "enormous.tif");
    write_stack(path, 32, 1, COMPRESSION_ADOBE_DEFLATE, TEST_STRIPS);
    size_t n = read_file(path, data, sizeof data);
    patch_tag(data, TIFFTAG_ROWSPERSTRIP, UINT32_MAX); /* one strip */
    patch_tag(data, TIFFTAG_STRIPOFFSETS, 8);
    patch_tag(data, TIFFTAG_STRIPBYTECOUNTS, stored);
    for (size_t i = 0; i < sizeof edge / sizeof edge[0]; i++) {
        patch_tag(data, TIFFTAG_IMAGEWIDTH, edge[i][0]);
        patch_tag(data, TIFFTAG_IMAGELENGTH, edge[i][1]);
        test_write_bytes(path, data, n);
        assert_int_equal(truncate(path, 8 + stored), 0);
        expect_open_error(path, STATUS_TOO_LARGE, "the limit is 1048576");
    }
}

/* A slice without material is a few bytes in these codecs. */
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
    path_of(path, "constant.tif");
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

/* A compressed page of 2^40 bytes that a file of a MiB might hold. */
static void test_compressed_pages_have_a_limit(void **state)
{
    (void)state;
    static uint8_t data[1 << 16];
    char path[128];
    path_of(path, "bomb.tif");
    write_stack(path, 8, 1, COMPRESSION_ZSTD, TEST_STRIPS);
    size_t n = read_file(path, data, sizeof data);
    patch_tag(data, TIFFTAG_IMAGEWIDTH, 1 << 20);
    patch_tag(data, TIFFTAG_IMAGELENGTH, 1 << 20);
    test_write_bytes(path, data, n);
    expect_open_error(path, STATUS_TOO_LARGE, "page 1 is compressed and over 4 GiB");
}

/* Its values fall with density: neither taken as they are, nor turned round in silence. */
static void test_white_is_zero(void **state)
{
    (void)state;
    static uint8_t data[1 << 16];
    char path[128];
    path_of(path, "white.tif");
    write_stack(path, 16, 1, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = read_file(path, data, sizeof data);
    patch_tag(data, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISWHITE);
    test_write_bytes(path, data, n);
    expect_open_error(path, STATUS_UNSUPPORTED,
                      "page 1 has PhotometricInterpretation 0 (white is zero): save the stack with black as zero");
}

static status read_whole(const char *path, struct reconstruct_option *o, struct error *err)
{
    struct volume v;
    struct reconstruct_report r = {0};
    status s = reconstruct_read(&path, 1, o, NULL, NULL, NULL, &v, &r, err);
    if (s == STATUS_OK) volume_release(&v);
    return s;
}

static void test_bad_values(void **state)
{
    (void)state;
    char path[128];
    struct error err = {0};
    struct reconstruct_option o;
    float pixel[W * H];
    struct test_page page[N];
    path_of(path, "values.tif");
    for (size_t i = 0; i < W * H; i++) pixel[i] = (float)(i % 9);
    for (size_t i = 0; i < N; i++) page[i] = (struct test_page){W, H, 32, pixel};
    reconstruct_option_default(&o);
    test_write_tiff(path, page, N, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_VOXEL_SIZE);
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = 2e-6;
    pixel[40] = NAN;
    test_write_tiff(path, page, N, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.text, "cannot use the volume: voxel (3, 1, 0) is NaN");
    pixel[40] = -INFINITY; /* what cells from outside of the scan are marked with */
    test_write_tiff(path, page, N, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.text, "cannot use the volume: voxel (3, 1, 0) is infinite");
    for (size_t i = 0; i < W * H; i++) pixel[i] = 7.0f;
    test_write_tiff(path, page, N, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.text, "cannot use the volume: every voxel has the value 7");
    for (size_t i = 0; i < W * H; i++) pixel[i] = (float)(i % 9);
    test_write_tiff(path, page, N, COMPRESSION_NONE, TEST_STRIPS);
    o.density_low = 100.0;
    o.density_high = 200.0;
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "it is empty, no density reaches 0.5"));
    o.density_high = 50.0;
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_DENSITY_HIGH);
    memcpy(o.axes, "xyy", 4);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_AXES);
}

static void test_missing(void **state)
{
    (void)state;
    expect_open_error("/nonexistent/a.tif", STATUS_NOT_FOUND, "cannot read volume 'a.tif': no such file");
    char path[128];
    path_of(path, "text.tif");
    test_write_bytes(path, "hello, this is not a volume", 27);
    expect_open_error(path, STATUS_UNSUPPORTED, "neither TIFF nor MetaImage");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sample_types),    cmocka_unit_test(test_kinds),
        cmocka_unit_test(test_slices),          cmocka_unit_test(test_unlike_pages),
        cmocka_unit_test(test_truncated),       cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_lying_header),    cmocka_unit_test(test_enormous_pages),
        cmocka_unit_test(test_constant_slices), cmocka_unit_test(test_compressed_pages_have_a_limit),
        cmocka_unit_test(test_white_is_zero),   cmocka_unit_test(test_bad_values),
        cmocka_unit_test(test_missing),
    };
    return cmocka_run_group_tests(tests, make_folder, NULL);
}
