/* OpenEXR and PNG files: round trips, and faulty files. */
#include "base/rng.h"
#include "renderer/image/image.h"

#include <OpenEXR/openexr.h>
#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { LIMIT = 1 << 22 };
static char folder[64];

static const char *path_of(const char *name)
{
    static char path[2][128];
    static int turn;
    turn = 1 - turn;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "%s", "/tmp/selvedge-image-XXXXXX");
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *const name[] = {"a.exr", "b.exr", "c.png"};
    for (size_t i = 0; i < sizeof name / sizeof name[0]; i++) unlink(path_of(name[i]));
    return rmdir(folder);
}

static char *slurp(const char *path, size_t *n)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    fseek(f, 0, SEEK_END);
    *n = (size_t)ftell(f);
    rewind(f);
    char *data = malloc(*n);
    assert_int_equal(fread(data, 1, *n, f), *n);
    fclose(f);
    return data;
}

static void spill(const char *path, const char *data, size_t n)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    assert_int_equal(fwrite(data, 1, n, f), n);
    fclose(f);
}

static void fill(struct image *im)
{
    for (size_t i = 0; i < im->width * im->height * im->n_channel; i++) im->pixel[i] = (float)i * 0.125f - 3;
}

static void exr_round_trip(void **state)
{
    (void)state;
    static const char *const name[5] = {"R", "G", "B", "var.R", "d_beta_R.G"};
    struct image im, back;
    struct error err = {0};
    assert_int_equal(image_init(&im, 37, 41, 5, &err), STATUS_OK); /* not a multiple of the 16 lines of a chunk */
    im.channel_name = name;
    fill(&im);
    assert_int_equal(image_write_exr(&im, path_of("a.exr"), &err), STATUS_OK);
    if (image_read_exr(&back, path_of("a.exr"), LIMIT, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(back.width == 37 && back.height == 41 && back.n_channel == 3);
    for (size_t i = 0; i < 37 * 41; i++)
        for (size_t c = 0; c < 3; c++) assert_true(back.pixel[3 * i + c] == im.pixel[5 * i + c]);
    image_release(&back);
    assert_int_equal(image_read_exr(&back, path_of("a.exr"), 37 * 41 - 1, &err), STATUS_TOO_LARGE);
    assert_int_equal(image_read_exr_variance(&back, path_of("a.exr"), LIMIT, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "'var.G' is missing"));
    assert_int_equal(image_write_exr(&im, path_of("missing/x.exr"), &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "missing/x.exr"));
    image_release(&im);
}

static void exr_variances(void **state)
{
    (void)state;
    static const char *const name[6] = {"R", "G", "B", "var.R", "var.G", "var.B"};
    struct image im, back;
    struct error err = {0};
    assert_int_equal(image_init(&im, 19, 23, 6, &err), STATUS_OK);
    im.channel_name = name;
    fill(&im);
    assert_int_equal(image_write_exr(&im, path_of("a.exr"), &err), STATUS_OK);
    if (image_read_exr_variance(&back, path_of("a.exr"), LIMIT, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (size_t i = 0; i < 19 * 23; i++)
        for (size_t c = 0; c < 3; c++) assert_true(back.pixel[3 * i + c] == im.pixel[6 * i + 3 + c]);
    image_release(&back);
    image_release(&im);
}

static uint16_t half_of(float x) /* exact values only */
{
    uint32_t b;
    memcpy(&b, &x, sizeof b);
    return (uint16_t)((b >> 16 & 0x8000) | (b == 0 ? 0 : (((b >> 23 & 255) - 112) << 10) | (b >> 13 & 0x3ff)));
}

/* Writes a half-float file directly with the library, either with scan lines (tile 0) or with tiles. */
static void write_half(const char *path, const char *const *name, int n_channel, int width, int height, int tile)
{
    exr_context_t file;
    int part;
    assert_int_equal(exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, NULL), EXR_ERR_SUCCESS);
    assert_int_equal(exr_add_part(file, "p", tile > 0 ? EXR_STORAGE_TILED : EXR_STORAGE_SCANLINE, &part),
                     EXR_ERR_SUCCESS);
    assert_int_equal(exr_initialize_required_attr_simple(file, part, width, height, EXR_COMPRESSION_NONE),
                     EXR_ERR_SUCCESS);
    if (tile > 0)
        assert_int_equal(exr_set_tile_descriptor(file, part, (uint32_t)tile, (uint32_t)tile, EXR_TILE_ONE_LEVEL,
                                                 EXR_TILE_ROUND_DOWN),
                         EXR_ERR_SUCCESS);
    for (int c = 0; c < n_channel; c++)
        assert_int_equal(exr_add_channel(file, part, name[c], EXR_PIXEL_HALF, EXR_PERCEPTUALLY_LINEAR, 1, 1),
                         EXR_ERR_SUCCESS);
    assert_int_equal(exr_write_header(file), EXR_ERR_SUCCESS);
    int step_x = tile > 0 ? tile : width, step_y = tile > 0 ? tile : 1;
    for (int y = 0, j = 0; y < height; y += step_y, j++)
        for (int x = 0, i = 0; x < width; x += step_x, i++) {
            exr_chunk_info_t chunk;
            exr_result_t r = tile > 0 ? exr_write_tile_chunk_info(file, part, i, j, 0, 0, &chunk)
                                      : exr_write_scanline_chunk_info(file, part, y, &chunk);
            assert_int_equal(r, EXR_ERR_SUCCESS);
            size_t n = (size_t)(chunk.width * chunk.height * n_channel), k = 0;
            uint16_t *data = malloc(2 * n);
            for (int yy = 0; yy < chunk.height; yy++) /* by line, then channel (in order of name), then pixel */
                for (int c = 0; c < n_channel; c++)
                    for (int xx = 0; xx < chunk.width; xx++)
                        data[k++] = half_of((float)(x + xx) + 0.5f * (float)(y + yy) + 0.25f * (float)c);
            r = tile > 0 ? exr_write_tile_chunk(file, part, i, j, 0, 0, data, 2 * n)
                         : exr_write_scanline_chunk(file, part, y, data, 2 * n);
            assert_int_equal(r, EXR_ERR_SUCCESS);
            free(data);
        }
    assert_int_equal(exr_finish(&file), EXR_ERR_SUCCESS);
}

/* Compression hardly reduces chunks of path-traced noise. A compressing writer damages the one chunk in some 200 whose
 * compressed size equals its size. */
static void exr_noise_survives(void **state)
{
    (void)state;
    static const char *const name[] = {"R", "G", "B"};
    const struct rng_key key = {.seed = 7};
    for (uint32_t round = 0; round < 60; round++) {
        struct image im, back;
        struct rng rng;
        struct error err;
        assert_int_equal(image_init(&im, 64, 64, 3, &err), STATUS_OK);
        im.channel_name = name;
        rng_start(&rng, &key, round, 0);
        for (size_t i = 0; i < (size_t)64 * 64 * 3; i++) im.pixel[i] = 0.2f + rng_float(&rng);
        assert_int_equal(image_write_exr(&im, path_of("a.exr"), &err), STATUS_OK);
        assert_int_equal(image_read_exr(&back, path_of("a.exr"), LIMIT, &err), STATUS_OK);
        assert_memory_equal(im.pixel, back.pixel, (size_t)64 * 64 * 3 * sizeof(float));
        image_release(&im);
        image_release(&back);
    }
}

static void exr_half_tiled_grey(void **state)
{
    (void)state;
    static const char *const bgr[3] = {"B", "G", "R"}, *const y[1] = {"Y"};
    for (int k = 0; k < 4; k++) {
        struct image im;
        struct error err = {0};
        int grey = k >= 2;
        write_half(path_of("a.exr"), grey ? y : bgr, grey ? 1 : 3, 21, 13, k % 2 ? 8 : 0);
        if (image_read_exr(&im, path_of("a.exr"), LIMIT, &err) != STATUS_OK) fail_msg("case %d: %s", k, err.text);
        assert_true(im.width == 21 && im.height == 13);
        for (size_t i = 0; i < 21 * 13; i++)
            for (size_t c = 0; c < 3; c++) {
                float want = (float)(i % 21) + 0.5f * (float)(i / 21) + (grey ? 0 : 0.25f * (float)(2 - c));
                assert_true(im.pixel[3 * i + c] == want);
            }
        image_release(&im);
    }
}

/* Half channels of other names beside the wanted ones: every set of up to four names of which some picture can be
 * read. */
static void exr_other_channels(void **state)
{
    (void)state;
    static const char *const name[] = {"A", "B", "G", "R", "Y", "Z", "a", "n"};
    const unsigned all = sizeof name / sizeof *name;
    int n_read = 0;
    for (unsigned set = 1; set < 1u << all; set++) {
        const char *in[8];
        int n = 0, at[5] = {-1, -1, -1, -1, -1};
        for (unsigned i = 0; i < all; i++) {
            if (!(set >> i & 1)) continue;
            if (i >= 1 && i <= 4) at[i] = n;
            in[n++] = name[i];
        }
        const bool rgb = at[1] >= 0 && at[2] >= 0 && at[3] >= 0, grey = at[4] >= 0 && at[1] + at[2] + at[3] == -3;
        if (n > 5 || (!rgb && !grey)) continue;
        for (int tile = 0; tile <= 8; tile += 8) {
            struct image im;
            struct error err = {0};
            write_half(path_of("a.exr"), in, n, 21, 13, tile);
            if (image_read_exr(&im, path_of("a.exr"), LIMIT, &err) != STATUS_OK) fail_msg("set %u: %s", set, err.text);
            for (size_t i = 0; i < 21 * 13 * 3; i++)
                assert_true(im.pixel[i] == (float)(i / 3 % 21) + 0.5f * (float)(i / 63) +
                                               0.25f * (float)(rgb ? at[3 - i % 3] : at[4]));
            image_release(&im);
            n_read++;
        }
    }
    assert_true(n_read > 60);
}

/* Channels whose names say that they are no rgb. */
static void exr_of_other_colors(void **state)
{
    (void)state;
    static const char *const yc[3] = {"BY", "RY", "Y"}, *const xyz[3] = {"X", "Y", "Z"};
    struct image im;
    struct error err = {0};
    write_half(path_of("a.exr"), yc, 3, 21, 13, 0);
    assert_int_equal(image_read_exr(&im, path_of("a.exr"), LIMIT, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "luminance and chroma"));
    write_half(path_of("a.exr"), xyz, 3, 21, 13, 8);
    assert_int_equal(image_read_exr(&im, path_of("a.exr"), LIMIT, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "tristimulus"));
}

static void bad_files(void **state)
{
    (void)state;
    static const char *const rg[2] = {"G", "R"};
    struct image im;
    struct error err = {0};
    assert_int_equal(image_read_exr(&im, path_of("none.exr"), LIMIT, &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "none.exr"));
    write_half(path_of("a.exr"), rg, 2, 5, 5, 0);
    assert_int_equal(image_read_exr(&im, path_of("a.exr"), LIMIT, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "'B' is missing"));
    spill(path_of("b.exr"), "this is no picture, nor was it ever", 35);
    assert_int_equal(image_read_exr(&im, path_of("b.exr"), LIMIT, &err), STATUS_FORMAT);
    spill(path_of("b.exr"), "", 0);
    assert_int_equal(image_read_exr(&im, path_of("b.exr"), LIMIT, &err), STATUS_FORMAT);
}

/* Every truncation and a few thousand changed bytes must give an error or a picture, and never a crash. The sanitizer
 * build runs this test too. */
static void truncated_and_damaged(void **state)
{
    (void)state;
    struct image im;
    struct error err = {0};
    assert_int_equal(image_init(&im, 19, 23, 3, &err), STATUS_OK);
    fill(&im);
    assert_int_equal(image_write_exr(&im, path_of("a.exr"), &err), STATUS_OK);
    image_release(&im);
    size_t n;
    char *data = slurp(path_of("a.exr"), &n);
    for (size_t k = 0; k < n; k += 7) {
        spill(path_of("b.exr"), data, k);
        status st = image_read_exr(&im, path_of("b.exr"), LIMIT, &err);
        assert_int_equal(st, STATUS_FORMAT);
        assert_true(strlen(err.text) > 20);
    }
    unsigned seed = 1;
    for (int k = 0; k < 1500; k++) {
        char *copy = malloc(n);
        memcpy(copy, data, n);
        for (int j = 0; j < 3; j++) {
            seed = seed * 1664525u + 1013904223u;
            copy[(seed >> 8) % (k % 2 ? n : 400)] = (char)(seed >> 3);
        }
        spill(path_of("b.exr"), copy, n);
        if (image_read_exr(&im, path_of("b.exr"), 1 << 16, &err) == STATUS_OK) image_release(&im);
        free(copy);
    }
    free(data);
}

static void png_is_srgb(void **state)
{
    (void)state;
    struct image im;
    struct error err = {0};
    assert_int_equal(image_init(&im, 4, 1, 3, &err), STATUS_OK);
    static const float value[4] = {0, 0.5f, 2, NAN};
    static const unsigned char want[4] = {0, 188, 255, 0};
    for (size_t i = 0; i < 12; i++) im.pixel[i] = value[i / 3];
    assert_int_equal(image_write_png(&im, 1.0, path_of("c.png"), &err), STATUS_OK);
    image_release(&im);
    png_image png;
    memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    assert_true(png_image_begin_read_from_file(&png, path_of("c.png")));
    png.format = PNG_FORMAT_RGB;
    unsigned char rgb[12];
    assert_true(png.width == 4 && png.height == 1 && png_image_finish_read(&png, NULL, rgb, 0, NULL));
    for (size_t i = 0; i < 12; i++) assert_int_equal(rgb[i], want[i / 3]);
    assert_int_equal(image_write_png_rgb8(rgb, 4, 1, path_of("missing/x.png"), &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "missing/x.png"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exr_round_trip),     cmocka_unit_test(exr_variances),
        cmocka_unit_test(exr_noise_survives), cmocka_unit_test(exr_half_tiled_grey),
        cmocka_unit_test(exr_other_channels), cmocka_unit_test(exr_of_other_colors),
        cmocka_unit_test(bad_files),          cmocka_unit_test(truncated_and_damaged),
        cmocka_unit_test(png_is_srgb),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
