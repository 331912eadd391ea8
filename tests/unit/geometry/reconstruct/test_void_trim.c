/* Void above and below the cloth of a large scan is left out when it is read. */
#include "base/rng.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/reconstruct/void_trim.h"
#include "geometry/volume/format/volume_source.h"
#include "tests/support/scan/scan_files.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>
#include <unistd.h>

#include <cmocka.h>

enum { LONG = 300, WIDE = 40, HIGH = 34, SHEET_FROM = 140, SHEET_TO = 150, KEPT_FROM = 75, KEPT_TO = 215 };

static char folder[64], path[100];

/* Writes a scan of n voxels with noise and a striped sheet across an axis (-1: none); its range along it is
 * SHEET_FROM .. SHEET_TO - 1. */
static void write_scan(const size_t n[3], int axis)
{
    uint8_t *value = malloc(n[0] * n[1] * n[2]);
    struct test_page *page = calloc(n[2], sizeof *page);
    struct rng rng;
    assert_non_null(value);
    assert_non_null(page);
    rng_start(&rng, &(struct rng_key){.seed = 5}, 0, 0);
    for (size_t k = 0, at = 0; k < n[2]; k++) {
        page[k] = (struct test_page){(uint32_t)n[0], (uint32_t)n[1], 8, value + k * n[0] * n[1]};
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++, at++) {
                const size_t x[3] = {i, j, k};
                const bool solid = axis >= 0 && x[axis] >= SHEET_FROM && x[axis] < SHEET_TO && (i + j + k) % 12 < 8;
                value[at] = (uint8_t)((solid ? 160.0f : 60.0f) + 60.0f * rng_float(&rng));
            }
    }
    snprintf(path, sizeof path, "%s/scan.tif", folder);
    test_write_tiff(path, page, n[2], COMPRESSION_NONE, TEST_STRIPS);
    free(page);
    free(value);
}

static void find(const size_t n[3], int sheet, int axis, size_t range[2])
{
    const char *file = path;
    struct volume_source *source;
    write_scan(n, sheet);
    assert_int_equal(volume_source_open(&file, 1, &source, NULL), STATUS_OK);
    assert_int_equal(void_trim_find(source, &(struct scan_look){0}, axis, NULL, range, NULL), STATUS_OK);
    volume_source_close(source);
}

/* The sheet is found along every axis of the file; noise alone and a sheet along the axis leave everything. */
static void test_layers_with_material(void **state)
{
    (void)state;
    size_t range[2];
    for (int axis = 0; axis < 3; axis++) {
        size_t n[3] = {WIDE, WIDE, WIDE};
        n[axis] = LONG;
        find(n, axis, axis, range);
        const size_t more = axis < 2; /* the mean of 3 x 3 voxels of a slice reaches a layer farther */
        assert_int_equal(range[0], KEPT_FROM - more);
        assert_int_equal(range[1], KEPT_TO + more);
        find(n, axis, (axis + 1) % 3, range);
        assert_true(range[0] == 0 && range[1] == WIDE);
        find(n, -1, axis, range);
        assert_true(range[0] == 0 && range[1] == LONG);
    }
}

static void read_scan(struct reconstruct_option *o, struct volume *v)
{
    struct reconstruct_report report = {0};
    struct error err = {0};
    const char *file = path;
    for (int a = 0; a < 3; a++) o->voxel_size_m[a] = 2e-6;
    if (reconstruct_read(&file, 1, o, NULL, NULL, NULL, v, &report, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* A scan above the limit is read as a job with that box would read it, and the options have the box. */
static void test_large_scans_are_trimmed(void **state)
{
    (void)state;
    static const char *const axes[3] = {"xyz", "xy-z", "yz-x"};
    for (int i = 0; i < 3; i++) {
        const size_t n[3] = {i == 2 ? LONG : WIDE, HIGH, i == 2 ? WIDE : LONG};
        struct reconstruct_option trimmed, given;
        struct volume x, y;
        write_scan(n, i == 2 ? 0 : 2);
        reconstruct_option_default(&trimmed);
        snprintf(trimmed.axes, sizeof trimmed.axes, "%s", axes[i]);
        trimmed.trim_above_voxel = 1000;
        given = trimmed;
        const size_t from = i == 2 ? KEPT_FROM - 1 : KEPT_FROM, to = i == 2 ? KEPT_TO + 1 : KEPT_TO;
        const bool down = i > 0;
        const size_t box[6] = {
            0, 0, down ? LONG - to : from, i == 2 ? HIGH : WIDE, i == 2 ? WIDE : HIGH, down ? LONG - from : to};
        memcpy(given.crop_voxel, box, sizeof box);
        read_scan(&trimmed, &x);
        assert_memory_equal(trimmed.crop_voxel, box, sizeof box);
        read_scan(&given, &y);
        assert_memory_equal(x.n, y.n, sizeof x.n);
        assert_int_equal(x.n[2], to - from);
        assert_memory_equal(x.density, y.density, volume_n_voxel(x.n) * sizeof *x.density);
        volume_release(&x);
        volume_release(&y);
    }
}

/* The box that tiles is one of the whole scan, too. */
static void test_the_box_that_tiles(void **state)
{
    (void)state;
    struct reconstruct_option o;
    struct volume v;
    write_scan((const size_t[3]){WIDE, WIDE, LONG}, 2);
    reconstruct_option_default(&o);
    o.trim_above_voxel = 1000;
    o.crop = true;
    read_scan(&o, &v);
    assert_int_equal(o.crop_voxel[2], KEPT_FROM);
    assert_int_equal(o.crop_voxel[5], KEPT_TO);
    assert_int_equal(v.n[2], KEPT_TO - KEPT_FROM);
    volume_release(&v);
}

static int make_folder(void **state)
{
    (void)state;
    test_make_folder(folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_layers_with_material),
                                       cmocka_unit_test(test_large_scans_are_trimmed),
                                       cmocka_unit_test(test_the_box_that_tiles)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
