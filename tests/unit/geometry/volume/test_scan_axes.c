/* Turned and mirrored scans: orientation of TIFF pages, directions of NRRD and MetaImage, channels of a pixel. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/format/axis_directions.h"
#include "geometry/volume/format/volume_source.h"
#include "geometry/volume/volume_align.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

enum { W = 5, H = 3 };

/* The seen picture has 10 x + y at column x, row y. Writes it as it is stored in an orientation. */
static void write_page(const char *path, int orientation)
{
    const bool transposed = orientation >= 5;
    const int columns = transposed ? H : W, rows = transposed ? W : H;
    uint8_t row[W];
    TIFF *t = TIFFOpen(path, "w");
    TIFFSetField(t, TIFFTAG_IMAGEWIDTH, columns);
    TIFFSetField(t, TIFFTAG_IMAGELENGTH, rows);
    TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(t, TIFFTAG_ORIENTATION, orientation);
    for (int r = 0; r < rows; r++) {
        for (int c = 0; c < columns; c++) {
            /* the definition: what row 0 and column 0 are in the seen picture */
            const bool row_from_end = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
            const bool column_from_end = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
            const int along_rows = row_from_end ? rows - 1 - r : r,
                      along_columns = column_from_end ? columns - 1 - c : c;
            row[c] = (uint8_t)(transposed ? 10 * along_rows + along_columns : 10 * along_columns + along_rows);
        }
        assert_true(TIFFWriteScanline(t, row, (uint32_t)r, 0) == 1);
    }
    TIFFClose(t);
}

static void test_orientation(void **state)
{
    for (int orientation = 1; orientation <= 8; orientation++) {
        const char *path = scratch_path(state, "o.tif");
        struct volume_source *source = NULL;
        float value[W * H];
        write_page(path, orientation);
        assert_int_equal(volume_source_open(&path, 1, &source, NULL), STATUS_OK);
        const struct volume_source_info *info = volume_source_describe(source);
        assert_true(info->n[0] == W && info->n[1] == H && info->n[2] == 1);
        assert_int_equal(file_ledger_find(&info->ledger, "orientation") != NULL, orientation > 1);
        assert_int_equal(volume_source_read(source, 0, 1, value, NULL), STATUS_OK);
        for (int y = 0; y < H; y++)
            for (int x = 0; x < W; x++)
                if (value[y * W + x] != (float)(10 * x + y)) fail_msg("orientation %d, (%d, %d)", orientation, x, y);
        volume_source_close(source);
    }
}

/* Directions of the axes of a file, with the name that they have. */
static void test_names(void **state)
{
    (void)state;
    struct {
        double direction[3][3];
        const char *name;
    } c[] = {{{{2, 0, 0}, {0, 2, 0}, {0, 0, 2}}, "xyz"},   {{{2, 0, 0}, {0, 2, 0}, {0, 0, -3}}, "xy-z"},
             {{{0, 0, 1}, {0, 1, 0}, {1, 0, 0}}, "zyx"},   {{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}, "zxy"},
             {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}, "y-xz"}, {{{1, 0.0009, 0}, {0, 1, 0}, {0, 0, 1}}, "xyz"},
             {{{1, 0.0011, 0}, {0, 1, 0}, {0, 0, 1}}, ""}, {{{1, 0, 0}, {0.5, 1, 0}, {0, 0, 1}}, ""},
             {{{1, 0, 0}, {1, 0, 0}, {0, 0, 1}}, ""}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        char axes[8];
        assert_int_equal(axis_directions_name(c[i].direction, axes), c[i].name[0] != '\0');
        assert_string_equal(axes, c[i].name);
        if (axes[0] == '\0') continue;
        /* The axes put every voxel where the directions put it, and mirror where their determinant is below 0. */
        struct axis_map map;
        const double(*d)[3] = (const double(*)[3])c[i].direction;
        const double determinant = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) -
                                   d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                                   d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
        assert_int_equal(axis_map_parse(axes, &map, NULL), STATUS_OK);
        for (int w = 0; w < 3; w++)
            assert_true((d[map.source[w]][w] < 0.0) == map.flip[w] && d[map.source[w]][w] != 0.0);
        assert_int_equal(axes_are_mirrored(axes), determinant < 0.0);
    }
}

/* Handedness of a helix: > 0 for a right hand (Z twist of a yarn along z). */
static double handedness(const struct volume *v)
{
    double sum = 0.0;
    double before[2] = {0.0, 0.0};
    for (size_t k = 0; k < v->n[2]; k++) {
        double at[2] = {0.0, 0.0};
        for (size_t j = 0; j < v->n[1]; j++)
            for (size_t i = 0; i < v->n[0]; i++) {
                const double d = v->density[volume_index(v->n, i, j, k)];
                at[0] += d * ((double)i - 0.5 * (double)(v->n[0] - 1));
                at[1] += d * ((double)j - 0.5 * (double)(v->n[1] - 1));
            }
        if (k > 0) sum += before[0] * at[1] - before[1] * at[0];
        memcpy(before, at, sizeof before);
    }
    return sum;
}

static void test_twist_survives_a_mirrored_file(void **state)
{
    enum { N = 32 };
    static const struct {
        const char *space, *directions;
        int turn;
    } c[] = {{"RAS", "(0.002,0,0) (0,0.002,0) (0,0,0.002)", 1},
             {"RAS", "(0.002,0,0) (0,0.002,0) (0,0,-0.002)", -1},
             {"RAS", "(-0.002,0,0) (0,0.002,0) (0,0,0.002)", -1},
             {"RAS", "(0,0.002,0) (0.002,0,0) (0,0,0.002)", -1},
             {"LAS", "(0.002,0,0) (0,0.002,0) (0,0,0.002)", -1}};
    static uint8_t file[256 + N * N * N];
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        const char *path = scratch_path(state, "helix.nrrd");
        int n = snprintf((char *)file, 256,
                         "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 32 32 32\nencoding: raw\nspace: "
                         "%s\nspace directions: %s\n\n",
                         c[i].space, c[i].directions);
        for (int k = 0; k < N; k++)
            for (int j = 0; j < N; j++)
                for (int x = 0; x < N; x++) {
                    const double angle = c[i].turn * 0.15 * k, dx = x - 15.5 - 9.0 * cos(angle),
                                 dy = j - 15.5 - 9.0 * sin(angle);
                    file[n++] = (uint8_t)(40.0 + 150.0 * fmin(1.0, fmax(0.0, 5.5 - hypot(dx, dy))) +
                                          (x * 7 + j * 5 + k * 3) % 11);
                }
        scratch_write(path, file, (size_t)n);
        struct reconstruct_option o;
        struct reconstruct_report r = {.n = {0}};
        struct volume v = {0};
        struct error err = {0};
        reconstruct_option_default(&o);
        if (reconstruct_read(&path, 1, &o, NULL, NULL, NULL, &v, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
        if (!(handedness(&v) > 0.0)) fail_msg("'%s' in %s became a mirror image", c[i].directions, c[i].space);
        volume_release(&v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orientation),
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_twist_survives_a_mirrored_file),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
