/* DNG of floating point samples: linear rgb is read, in strips and tiles, compressed, and beside a preview; mosaics are
 * refused by name. JPEG with bytes between its segments, which is read, and within its picture data, which is not. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/float_dng.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/support/camera_files.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

enum { WIDTH = 40, HEIGHT = 24, N = WIDTH * HEIGHT * 3, TILE = 16 };

enum kind { STRIPS, TILES, DEFLATE, PREVIEW, MOSAIC, HALF };

/* Writes the tags of a picture of floats. */
static void set_tags(TIFF *tiff, enum kind kind)
{
    const float black = 0.25f;
    const uint32_t white = 2;
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, WIDTH);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, HEIGHT);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind == HALF ? 16 : 32);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind == MOSAIC ? 1 : 3);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind == MOSAIC ? 32803 : 34892);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind == DEFLATE ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_NONE);
    if (kind == DEFLATE) TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_FLOATINGPOINT);
    TIFFSetField(tiff, TIFFTAG_BLACKLEVEL, 1, &black);
    TIFFSetField(tiff, TIFFTAG_WHITELEVEL, 1, &white);
}

static void write_samples(TIFF *tiff, enum kind kind, const float *sample)
{
    static float tile[TILE * TILE * 3];
    if (kind != TILES) {
        for (uint32_t y = 0; y < HEIGHT; y++) {
            float row[3 * WIDTH]; /* the predictor works in the buffer that it is given */
            memcpy(row, sample + 3 * WIDTH * y, sizeof row);
            assert_int_equal(TIFFWriteScanline(tiff, row, y, 0), 1);
        }
        return;
    }
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, TILE);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, TILE);
    for (uint32_t y = 0; y < HEIGHT; y += TILE)
        for (uint32_t x = 0; x < WIDTH; x += TILE) {
            for (uint32_t i = 0; i < TILE * TILE * 3; i++) {
                const uint32_t at_x = x + i / 3 % TILE, at_y = y + i / 3 / TILE;
                tile[i] = at_x < WIDTH && at_y < HEIGHT ? sample[3 * (at_y * WIDTH + at_x) + i % 3] : 99.0f;
            }
            assert_true(TIFFWriteTile(tiff, tile, x, y, 0, 0) > 0);
        }
}

static void write_dng(const char *path, enum kind kind, const float *sample)
{
    static const uint8_t version[4] = {1, 4, 0, 0};
    static uint8_t preview[8 * 8 * 3];
    uint64_t inner = 0;
    TIFF *tiff = TIFFOpen(path, "w");
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_DNGVERSION, version);
    if (kind == PREVIEW) {
        TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, 1);
        TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 8);
        TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 8);
        TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
        TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 3);
        TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
        TIFFSetField(tiff, TIFFTAG_SUBIFD, 1, &inner);
        for (uint32_t y = 0; y < 8; y++) TIFFWriteScanline(tiff, preview + 24 * y, y, 0);
        assert_int_equal(TIFFWriteDirectory(tiff), 1);
    }
    set_tags(tiff, kind);
    write_samples(tiff, kind, sample);
    TIFFClose(tiff);
}

static void test_float_dng(void **state)
{
    static float sample[N];
    const struct job_photograph plain = photograph_plain(JOB_TRANSFER_UNDECLARED);
    const char *path = scratch_path(state, "float.dng");
    for (size_t i = 0; i < N; i++) sample[i] = 0.3f + (float)(i * 7 % 1000) * 0.001f;
    sample[3 * 100 + 1] = 2.5f; /* above white */
    for (int kind = STRIPS; kind <= HALF; kind++) {
        struct image im;
        struct photograph_record r;
        struct error err = {0};
        write_dng(path, (enum kind)kind, sample);
        status s = photograph_read(path, &plain, &im, &r, &err);
        if (kind >= MOSAIC) {
            assert_int_equal(s, STATUS_UNSUPPORTED);
            assert_non_null(strstr(err.text, "'float.dng': it is a DNG of floating point samples"));
            assert_non_null(strstr(err.text, "OpenEXR"));
            continue;
        }
        if (s != STATUS_OK) fail_msg("kind %d: %s", kind, err.text);
        assert_true(im.width == WIDTH && im.height == HEIGHT && r.info.black_level == 0.25);
        for (size_t i = 0; i < N; i++)
            assert_true(fabs((double)im.pixel[i] - ((double)sample[i] - 0.25) / 1.75) < 1e-6);
        assert_true(r.saturated_share == 1.0 / (WIDTH * HEIGHT));
        image_release(&im);
    }
    size_t n;
    write_dng(path, STRIPS, sample);
    char *whole = scratch_read(path, &n);
    for (size_t cut = n / 10; cut < n; cut += n / 10) {
        struct image im;
        struct error err = {0};
        scratch_write(path, whole, cut);
        if (photograph_read(path, &plain, &im, NULL, &err) == STATUS_OK) {
            assert_true(cut > N * sizeof(float)); /* the folder alone is at the end */
            image_release(&im);
        } else {
            assert_non_null(strstr(err.text, "float.dng"));
        }
    }
    free(whole);
}

static void test_a_picture_beyond_the_limit(void **state)
{
    static float sample[N];
    const char *path = scratch_path(state, "large.dng");
    write_dng(path, STRIPS, sample);
    for (size_t missing = 0; missing < 2; missing++) {
        struct image im;
        struct photograph_info info = {0};
        const struct photograph_request q = {.black_level = NAN, .limit_pixel = WIDTH * HEIGHT - missing};
        assert_int_equal(float_dng_read(path, &q, &im, &info, NULL), missing ? STATUS_TOO_LARGE : STATUS_OK);
        if (missing == 0) image_release(&im);
    }
}

/* Inserts bytes at a place. */
static void insert(const char *path, const char *data, size_t n, size_t at, const char *bytes, size_t n_byte)
{
    char *longer = malloc(n + n_byte);
    assert_non_null(longer);
    memcpy(longer, data, at);
    memcpy(longer + at, bytes, n_byte);
    memcpy(longer + at + n_byte, data + at, n - at);
    scratch_write(path, longer, n + n_byte);
    free(longer);
}

static void test_stray_bytes(void **state)
{
    static uint8_t rgb[WIDTH * HEIGHT * 3];
    const struct job_photograph p = photograph_plain(JOB_TRANSFER_SRGB);
    const char *path = scratch_path(state, "stray.jpg");
    struct photograph_mean want, m;
    struct error err = {0};
    size_t n, at = 2, n_header = 0;
    for (size_t i = 0; i < sizeof rgb; i++) rgb[i] = (uint8_t)(100 + i * 31 % 50);
    camera_write_jpeg(path, WIDTH, HEIGHT, rgb, 0.01);
    assert_int_equal(photograph_measure(path, &p, &want, NULL), STATUS_OK);
    char *data = scratch_read(path, &n);
    for (bool scan = false; !scan; n_header++) { /* before each segment of the header */
        const uint8_t *h = (const uint8_t *)data + at;
        assert_int_equal(h[0], 0xff);
        scan = h[1] == 0xda;
        insert(path, data, n, at, n_header % 2 == 0 ? "\0\0\0\0" : "\x11\xff\x00\x22", 4);
        if (photograph_measure(path, &p, &m, &err) != STATUS_OK) fail_msg("segment %zu: %s", n_header, err.text);
        assert_memory_equal(m.mean_rgb, want.mean_rgb, sizeof want.mean_rgb);
        assert_non_null(strstr(m.warning, "stray.jpg"));
        assert_non_null(file_ledger_find(&m.record.info.ledger, "damage beside the samples"));
        assert_true(m.record.info.exposure_s == want.record.info.exposure_s);
        at += 2 + ((size_t)h[2] << 8 | h[3]);
    }
    assert_true(n_header >= 5);
    for (size_t k = at + 20; k + 20 < n; k += n / 20) { /* a marker that does not belong into the picture data */
        insert(path, data, n, k, "\x11\xff\xd8\x22", 4);
        assert_int_equal(photograph_measure(path, &p, &m, &err), STATUS_FORMAT);
        assert_non_null(strstr(err.text, "'stray.jpg'"));
    }
    free(data);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_float_dng),
                                       cmocka_unit_test(test_a_picture_beyond_the_limit),
                                       cmocka_unit_test(test_stray_bytes)};
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
