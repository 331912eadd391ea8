/* Raw pictures that are no mosaic: linear DNG, as converters of raw files write it, and a sensor without colors. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <tiffio.h>

#include <cmocka.h>

enum { WIDTH = 34, HEIGHT = 28, TOP = 1, LEFT = 2, BOTTOM = 27, RIGHT = 32, BLACK = 512, WHITE = 16383, DAYLIGHT = 21 };

static const struct job_photograph plain = {
    .scale = 1.0, .exposure_s = NAN, .iso = NAN, .aperture = NAN, .black_level = NAN};

/* Another value for each sample of the file. */
static unsigned value_at(size_t row, size_t column, size_t channel)
{
    return (unsigned)(BLACK + 1000 + 500 * channel + 40 * row + column);
}

/* n_channel 3: linear rgb, 1: a sensor without colors. Rows and columns at the edges are masked. */
static void write_dng(const char *path, size_t n_channel)
{
    static const float matrix[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, neutral[3] = {1, 1, 1};
    static const float black[3] = {BLACK, BLACK, BLACK};
    static const uint32_t white[3] = {WHITE, WHITE, WHITE}, area[4] = {TOP, LEFT, BOTTOM, RIGHT};
    uint16_t sample[HEIGHT * WIDTH * 3];
    for (size_t i = 0, y = 0; y < HEIGHT; y++)
        for (size_t x = 0; x < WIDTH; x++)
            for (size_t c = 0; c < n_channel; c++) sample[i++] = (uint16_t)value_at(y, x, c);
    TIFF *tiff = TIFFOpen(path, "w");
    assert_non_null(tiff);
    TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, 0);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, WIDTH);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, HEIGHT);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, (int)n_channel);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, 34892); /* LinearRaw */
    TIFFSetField(tiff, TIFFTAG_MAKE, "Selvedge");
    TIFFSetField(tiff, TIFFTAG_MODEL, "Test camera");
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_DNGVERSION, "\1\3\0\0");
    TIFFSetField(tiff, TIFFTAG_UNIQUECAMERAMODEL, "Selvedge Test camera");
    if (n_channel == 3) {
        TIFFSetField(tiff, TIFFTAG_COLORMATRIX1, 9, matrix);
        TIFFSetField(tiff, TIFFTAG_ASSHOTNEUTRAL, 3, neutral);
        TIFFSetField(tiff, TIFFTAG_CALIBRATIONILLUMINANT1, DAYLIGHT);
    }
    TIFFSetField(tiff, TIFFTAG_BLACKLEVEL, (int)n_channel, black);
    TIFFSetField(tiff, TIFFTAG_WHITELEVEL, (int)n_channel, white);
    TIFFSetField(tiff, TIFFTAG_ACTIVEAREA, area);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, HEIGHT);
    assert_true(TIFFWriteEncodedStrip(tiff, 0, sample, (tmsize_t)(WIDTH * HEIGHT * n_channel * 2)) > 0);
    assert_int_equal(TIFFWriteDirectory(tiff), 1);
    TIFFClose(tiff);
}

static void check(void **state, size_t n_channel)
{
    const char *path = scratch_path(state, "a.dng");
    struct image im;
    struct photograph_record r;
    struct error err = {0};
    write_dng(path, n_channel);
    if (photograph_read(path, &plain, &im, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(im.width, RIGHT - LEFT);
    assert_int_equal(im.height, BOTTOM - TOP);
    assert_true(r.info.black_level == BLACK && r.info.full_scale == WHITE - BLACK && r.info.bits == 14);
    for (size_t y = 0; y < im.height; y++)
        for (size_t x = 0; x < im.width; x++)
            for (size_t c = 0; c < 3; c++) {
                const double have = (double)im.pixel[(y * im.width + x) * 3 + c];
                const double want =
                    (value_at(y + TOP, x + LEFT, n_channel == 3 ? c : 0) - BLACK) / (WHITE - BLACK + 0.0);
                if (fabs(have - want) > 1e-6) fail_msg("%zu %zu %zu: %g, not %g", y, x, c, have, want);
            }
    image_release(&im);
}

static void test_linear_rgb(void **state) { check(state, 3); }
static void test_a_sensor_without_colors(void **state) { check(state, 1); }

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_linear_rgb),
                                       cmocka_unit_test(test_a_sensor_without_colors)};
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
