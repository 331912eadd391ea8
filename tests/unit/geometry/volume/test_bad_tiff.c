/* TIFF volumes that are damaged, or have values that no scan has. The errors name the file. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/format/volume_part.h"
#include "geometry/volume/format/volume_source.h"
#include "tests/support/scan/tiff_stack.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>
#include <unistd.h>

#include <cmocka.h>

static void test_unlike_pages(void **state)
{
    (void)state;
    char path[128];
    void *p8 = stack_pixels(0, 8), *p16 = stack_pixels(0, 16), *p32 = stack_pixels(0, 32);
    stack_path(path, "silk.tif");
    struct test_page depth[3] = {
        {STACK_WIDTH, STACK_HEIGHT, 16, p16}, {STACK_WIDTH, STACK_HEIGHT, 16, p16}, {STACK_WIDTH, STACK_HEIGHT, 8, p8}};
    test_write_tiff(path, depth, 3, COMPRESSION_NONE, TEST_STRIPS);
    stack_expect_open_error(path, STATUS_FORMAT, "cannot read volume 'silk.tif': page 3 is 8-bit, page 1 is 16-bit");
    struct test_page size[2] = {{STACK_WIDTH, STACK_HEIGHT, 16, p16}, {STACK_WIDTH, STACK_HEIGHT - 1, 16, p16}};
    test_write_tiff(path, size, 2, COMPRESSION_NONE, TEST_STRIPS);
    stack_expect_open_error(path, STATUS_FORMAT, "page 2 has 37 x 22 pixels, page 1 has 37 x 23");
    free(p8);
    free(p16);
    free(p32);
}

/* A file that is cut at any place gives an error. It must not crash the reader, nor pass as a complete file. */
static void test_truncated(void **state)
{
    (void)state;
    char path[128];
    static uint8_t data[1 << 16];
    const char *list[1] = {path};
    stack_path(path, "cut.tif");
    stack_write(path, 16, STACK_PAGES, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data), n_directory = 0, n_count = 0;
    for (size_t keep = 0; keep < n; keep += 61) {
        struct error err = {0};
        struct volume_source *s = NULL;
        test_write_bytes(path, data, keep);
        assert_int_not_equal(volume_source_open(list, 1, &s, &err), STATUS_OK);
        assert_true(strlen(err.text) > 20);
        n_directory += strcmp(err.text, "cannot read volume 'cut.tif': Can not read TIFF directory") == 0;
        n_count += strcmp(err.text, "cannot read volume 'cut.tif': Can not read TIFF directory count") == 0;
    }
    assert_true(n_directory > 0 && n_count > 0); /* whole sentences of libtiff, without the folder */
}

/* Changed bytes may give an error or other values, but neither a crash nor an unlimited allocation. */
static void test_damaged(void **state)
{
    (void)state;
    char path[128];
    static uint8_t data[1 << 16];
    static float value[STACK_WIDTH * STACK_HEIGHT * STACK_PAGES];
    const char *list[1] = {path};
    stack_path(path, "damaged.tif");
    stack_write(path, 16, STACK_PAGES, COMPRESSION_ADOBE_DEFLATE, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data);
    for (size_t i = 0; i < n; i += 7) {
        struct error err = {0};
        struct volume_source *s = NULL;
        data[i] ^= 0xff;
        test_write_bytes(path, data, n);
        if (volume_source_open(list, 1, &s, &err) == STATUS_OK) {
            const size_t *shape = volume_source_describe(s)->n;
            if (shape[0] * shape[1] * shape[2] <= STACK_WIDTH * STACK_HEIGHT * STACK_PAGES)
                volume_source_read(s, 0, shape[2], value, &err);
            volume_source_close(s);
        }
        data[i] ^= 0xff;
    }
}

static void test_lying_header(void **state)
{
    (void)state;
    char path[128];
    static uint8_t data[1 << 16];
    stack_path(path, "liar.tif");
    stack_write(path, 8, 1, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data);
    tiff_patch_tag(data, TIFFTAG_IMAGEWIDTH, 400000);
    test_write_bytes(path, data, n);
    stack_expect_open_error(path, STATUS_FORMAT, "cannot read volume 'liar.tif': page 1 states 400000 x 23 pixels");
}

/* A strip or tile that begins or ends beyond the end of the file is refused when the file is opened; one that ends
 * exactly there is read. */
static void test_strip_beyond_the_end(void **state)
{
    (void)state;
    static uint8_t data[1 << 16];
    const uint32_t stored = STACK_WIDTH * STACK_HEIGHT;
    char path[128];
    stack_path(path, "beyond.tif");
    stack_write(path, 8, 1, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data);
    tiff_patch_tag(data, TIFFTAG_ROWSPERSTRIP, STACK_HEIGHT);
    tiff_patch_tag(data, TIFFTAG_STRIPBYTECOUNTS, stored);
    const struct {
        uint32_t at;
        bool fits;
    } check[] = {{(uint32_t)n - stored, true},
                 {(uint32_t)n - stored + 1, false},
                 {(uint32_t)n, false},
                 {(uint32_t)n + 1, false},
                 {UINT32_MAX, false}};
    for (size_t i = 0; i < sizeof check / sizeof check[0]; i++) {
        struct volume_source *s = NULL;
        const char *list[1] = {path};
        tiff_patch_tag(data, TIFFTAG_STRIPOFFSETS, check[i].at);
        test_write_bytes(path, data, n);
        if (!check[i].fits) {
            stack_expect_open_error(path, STATUS_FORMAT, "but the file is too short for them");
            continue;
        }
        assert_int_equal(volume_source_open(list, 1, &s, NULL), STATUS_OK);
        volume_source_close(s);
    }
}

/* Samples of a kind that is not stated (4) count as whole numbers without a sign, as libtiff takes them. */
static void test_samples_of_no_stated_kind(void **state)
{
    (void)state;
    static uint8_t data[1 << 16];
    struct volume_source *s = NULL;
    char path[128];
    const char *list[1] = {path};
    stack_path(path, "void.tif");
    stack_write(path, 16, 1, COMPRESSION_NONE, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data);
    tiff_patch_tag(data, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_VOID);
    test_write_bytes(path, data, n);
    assert_int_equal(volume_source_open(list, 1, &s, NULL), STATUS_OK);
    assert_string_equal(volume_source_describe(s)->sample, "uint16");
    volume_source_close(s);
}

/* Sizes of several rows of such a page overflow an integer. The file can be small, because deflate compresses up to a
 * thousandfold. */
static void test_enormous_pages(void **state)
{
    (void)state;
    static const uint32_t edge[][2] = {{1, 3000000000u}, {3000000000u, 1}, {(1u << 20) + 1, STACK_HEIGHT}};
    const uint32_t stored = 8u << 20;
    static uint8_t data[1 << 16];
    char path[128];
    stack_path(path, "enormous.tif");
    stack_write(path, 32, 1, COMPRESSION_ADOBE_DEFLATE, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data);
    tiff_patch_tag(data, TIFFTAG_ROWSPERSTRIP, UINT32_MAX); /* one strip */
    tiff_patch_tag(data, TIFFTAG_STRIPOFFSETS, 8);
    tiff_patch_tag(data, TIFFTAG_STRIPBYTECOUNTS, stored);
    for (size_t i = 0; i < sizeof edge / sizeof edge[0]; i++) {
        tiff_patch_tag(data, TIFFTAG_IMAGEWIDTH, edge[i][0]);
        tiff_patch_tag(data, TIFFTAG_IMAGELENGTH, edge[i][1]);
        test_write_bytes(path, data, n);
        assert_int_equal(truncate(path, 8 + stored), 0);
        stack_expect_open_error(path, STATUS_TOO_LARGE, "the limit is 1048576");
    }
}

/* A compressed page of 2^40 bytes in a file of one MiB. */
static void test_compressed_pages_have_a_limit(void **state)
{
    (void)state;
    static uint8_t data[1 << 16];
    char path[128];
    stack_path(path, "bomb.tif");
    stack_write(path, 8, 1, COMPRESSION_ZSTD, TEST_STRIPS);
    size_t n = tiff_read_bytes(path, data, sizeof data);
    tiff_patch_tag(data, TIFFTAG_IMAGEWIDTH, 1 << 20);
    tiff_patch_tag(data, TIFFTAG_IMAGELENGTH, 1 << 20);
    test_write_bytes(path, data, n);
    stack_expect_open_error(path, STATUS_TOO_LARGE, "page 1 is compressed and over 4 GiB");
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
    float pixel[STACK_WIDTH * STACK_HEIGHT];
    struct test_page page[STACK_PAGES];
    stack_path(path, "values.tif");
    for (size_t i = 0; i < STACK_WIDTH * STACK_HEIGHT; i++) pixel[i] = (float)(i % 9);
    for (size_t i = 0; i < STACK_PAGES; i++) page[i] = (struct test_page){STACK_WIDTH, STACK_HEIGHT, 32, pixel};
    reconstruct_option_default(&o);
    test_write_tiff(path, page, STACK_PAGES, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_VOXEL_SIZE);
    for (int a = 0; a < 3; a++) o.voxel_size_m[a] = 2e-6;
    pixel[40] = NAN;
    test_write_tiff(path, page, STACK_PAGES, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.text, "cannot use the volume: voxel (3, 1, 0) is NaN");
    pixel[40] = -INFINITY; /* the mark of voxels from outside of the scan */
    test_write_tiff(path, page, STACK_PAGES, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.text, "cannot use the volume: voxel (3, 1, 0) is infinite");
    for (size_t i = 0; i < STACK_WIDTH * STACK_HEIGHT; i++) pixel[i] = 7.0f;
    test_write_tiff(path, page, STACK_PAGES, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(read_whole(path, &o, &err), STATUS_INVALID);
    assert_string_equal(err.text, "cannot use the volume: every voxel has the value 7");
    for (size_t i = 0; i < STACK_WIDTH * STACK_HEIGHT; i++) pixel[i] = (float)(i % 9);
    test_write_tiff(path, page, STACK_PAGES, COMPRESSION_NONE, TEST_STRIPS);
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

/* A file that goes, or becomes another, after it was opened gives an error and no voxels. */
static void test_files_that_change(void **state)
{
    (void)state;
    static uint8_t data[1 << 16];
    static float value[2 * STACK_WIDTH * STACK_HEIGHT];
    char first[128], second[128];
    const char *list[2] = {first, second};
    struct volume_source *s = NULL;
    struct error err = {0};
    stack_path(first, "first.tif");
    stack_path(second, "second.tif");
    stack_write(first, 8, 1, COMPRESSION_NONE, TEST_STRIPS);
    stack_write(second, 8, 1, COMPRESSION_NONE, TEST_STRIPS);
    assert_int_equal(volume_source_open(list, 2, &s, NULL), STATUS_OK);
    size_t n = tiff_read_bytes(second, data, sizeof data);
    assert_int_equal(volume_source_read(s, 0, 1, value, NULL), STATUS_OK);
    tiff_patch_tag(data, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISWHITE);
    test_write_bytes(second, data, n);
    assert_int_equal(volume_source_read(s, 1, 1, value, &err), STATUS_UNSUPPORTED);
    assert_int_equal(volume_source_read(s, 0, 1, value, NULL), STATUS_OK);
    unlink(second);
    assert_int_equal(volume_source_read(s, 1, 1, value, &err), STATUS_NOT_FOUND);
    volume_source_close(s);
}

static void test_the_part_that_is_read(void **state)
{
    (void)state;
    struct file_ledger ledger = {0};
    size_t index[2];
    const struct volume_parts parts = {.n = {3, 0}, .source = "the description"};
    const struct volume_part part = {.channel = 2};
    assert_int_equal(volume_part_choose("a.tif", &parts, &part, index, &ledger, NULL), STATUS_OK);
    assert_true(index[VOLUME_CHANNELS] == 1 && index[VOLUME_TIMES] == 0 && ledger.n == 1);
    assert_string_equal(ledger.item[0].value, "3, number 2 is read");
}

static void test_missing(void **state)
{
    (void)state;
    stack_expect_open_error("/nonexistent/a.tif", STATUS_NOT_FOUND, "cannot read volume 'a.tif': no such file");
    char path[128];
    stack_path(path, "text.tif");
    test_write_bytes(path, "hello, this is not a volume", 27);
    stack_expect_open_error(path, STATUS_UNSUPPORTED, "neither TIFF nor DICOM");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unlike_pages),
        cmocka_unit_test(test_truncated),
        cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_lying_header),
        cmocka_unit_test(test_enormous_pages),
        cmocka_unit_test(test_compressed_pages_have_a_limit),
        cmocka_unit_test(test_bad_values),
        cmocka_unit_test(test_missing),
        cmocka_unit_test(test_files_that_change),
        cmocka_unit_test(test_the_part_that_is_read),
        cmocka_unit_test(test_strip_beyond_the_end),
        cmocka_unit_test(test_samples_of_no_stated_kind),
    };
    return cmocka_run_group_tests(tests, stack_folder_setup, NULL);
}
