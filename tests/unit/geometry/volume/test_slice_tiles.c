/* Slices for a viewer: codes of directions and densities, files read back tile by tile, shrinking, and threads. */
#include "base/files/durable.h"
#include "base/rng.h"
#include "geometry/volume/slice_tiles.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

static char folder[64], path[128];

static int make_folder(void **state)
{
    (void)state;
    test_make_folder(folder);
    snprintf(path, sizeof path, "%s/a.slices", folder);
    return 0;
}

/* The squares of a code's direction, by the sentence in the documentation. */
static void squares_of(uint8_t code, double square[3])
{
    int at = 1;
    for (int x = 0; x <= SLICE_DIRECTION_STEPS; x++)
        for (int y = 0; x + y <= SLICE_DIRECTION_STEPS; y++, at++)
            if (at == code) {
                square[0] = (double)x / SLICE_DIRECTION_STEPS;
                square[1] = (double)y / SLICE_DIRECTION_STEPS;
                square[2] = 1.0 - square[0] - square[1];
                return;
            }
    fail_msg("no direction has the code %u", code);
}

static void test_direction_codes(void **state)
{
    (void)state;
    const struct rng_key key = {.seed = 7};
    for (uint32_t i = 0; i < 2000; i++) {
        struct rng rng;
        double a[2], b[2], square[3];
        rng_start(&rng, &key, i, 0);
        rng_normal_pair(&rng, a);
        rng_normal_pair(&rng, b);
        const float d[3] = {(float)a[0], (float)a[1], (float)b[0]};
        double length2 = a[0] * a[0] + a[1] * a[1] + b[0] * b[0];
        squares_of(slice_direction_code(d), square);
        for (int k = 0; k < 3; k++)
            assert_true(fabs(square[k] - (double)(d[k] * d[k]) / length2) <= 1.01 / SLICE_DIRECTION_STEPS);
    }
    assert_int_equal(slice_direction_code((const float[3]){0.0f, 0.0f, -3.0f}), 1);
    assert_int_equal(slice_direction_code((const float[3]){0.0f, 1.0f, 0.0f}), 1 + SLICE_DIRECTION_STEPS);
    assert_int_equal(slice_direction_code((const float[3]){1.0f, 0.0f, 0.0f}), 253);
}

/* A scan with random densities, of which the dense voxels have random directions. */
static void make_scan(const size_t n[3], struct volume *v, struct direction_volume *d)
{
    static const double size_m[3] = {1e-6, 2e-6, 3e-6};
    const struct rng_key key = {.seed = 3};
    assert_int_equal(volume_init(v, n, size_m, NULL), STATUS_OK);
    assert_int_equal(direction_volume_init(d, n, size_m, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(n); i++) {
        struct rng rng;
        double a[2], b[2];
        rng_start(&rng, &key, (uint32_t)i, 0);
        rng_normal_pair(&rng, a);
        rng_normal_pair(&rng, b);
        v->density[i] = (float)fabs(b[1]);
        if (v->density[i] < 0.7f) continue;
        d->density[i] = 255;
        direction_volume_set(d, i, (const float[3]){(float)a[0], (float)a[1], (float)b[0]});
    }
}

static uint32_t word(const char *data, size_t at)
{
    const uint8_t *p = (const uint8_t *)data + at;
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

/* Compares every tile of the file with what the codes, halved as often as its level says, have there. */
static void check_file(const struct slice_codes *c, int axis, const char *data, size_t n_byte)
{
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    size_t w = c->n[u], h = c->n[v], n_level = word(data, 32), n_tile = 0, i_tile = 0, edge = word(data, 28);
    assert_memory_equal(data, "SELVSLIC", 8);
    const size_t want[8] = {1, (size_t)axis, w, h, c->n[axis], SLICE_TILE_EDGE, n_level, c->factor};
    for (size_t i = 0; i < 8; i++) assert_int_equal(word(data, 8 + 4 * i), want[i]);
    for (size_t l = 0, x = w, y = h; l < n_level; l++, x = (x + 1) / 2, y = (y + 1) / 2)
        n_tile += ((x + edge - 1) / edge) * ((y + edge - 1) / edge);
    size_t at = 64 + 4 * n_tile * c->n[axis];
    uint8_t *plane = malloc(2 * w * h), *tile = malloc(2 * edge * edge);
    for (size_t slice = 0; slice < c->n[axis]; slice++) {
        size_t x = w, y = h;
        for (size_t i = 0; i < w * h; i++) {
            size_t place[3];
            place[axis] = slice;
            place[u] = i % w;
            place[v] = i / w;
            plane[i] = c->density[volume_index(c->n, place[0], place[1], place[2])];
            plane[w * h + i] = c->direction[volume_index(c->n, place[0], place[1], place[2])];
        }
        for (size_t l = 0; l < n_level; l++) {
            for (size_t y0 = 0; y0 < y; y0 += edge)
                for (size_t x0 = 0; x0 < x; x0 += edge) {
                    size_t tw = least(edge, x - x0), th = least(edge, y - y0);
                    uLongf n_out = 2 * edge * edge;
                    uint32_t length = word(data, 64 + 4 * i_tile++);
                    assert_int_equal(uncompress(tile, &n_out, (const Bytef *)data + at, length), Z_OK);
                    assert_int_equal(n_out, 2 * tw * th);
                    for (size_t row = 0; row < th; row++)
                        for (size_t part = 0; part < 2; part++)
                            assert_memory_equal(tile + (part * th + row) * tw,
                                                plane + part * w * h + (y0 + row) * x + x0, tw);
                    at += length;
                }
            slice_codes_halve(plane, plane + w * h, x, y, plane, plane + w * h);
            x = (x + 1) / 2;
            y = (y + 1) / 2;
        }
    }
    assert_int_equal(at, n_byte);
    free(plane);
    free(tile);
}

static void test_files(void **state)
{
    (void)state;
    static const size_t shape[][3] = {{7, 5, 3}, {1500, 3, 2}, {2, 1030, 4100}, {1, 1, 1}};
    struct thread_pool *pool;
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    for (size_t i = 0; i < sizeof shape / sizeof *shape; i++) {
        struct volume v;
        struct direction_volume d;
        struct slice_codes c;
        make_scan(shape[i], &v, &d);
        assert_int_equal(slice_codes_make(&v, &d, SLICE_MOST_VOXEL, pool, NULL, &c, NULL), STATUS_OK);
        for (size_t k = 0; k < volume_n_voxel(c.n); k++) {
            assert_int_equal(c.density[k], lrintf(SLICE_DENSITY_STEPS * fminf(1.0f, v.density[k])));
            assert_int_equal(c.direction[k] != 0, d.density[k] != 0);
        }
        for (int axis = 0; axis < 3; axis++) {
            char *data[2];
            size_t n_byte[2];
            for (int p = 0; p < 2; p++) {
                assert_int_equal(slice_tiles_write(&c, axis, p == 0 ? NULL : pool, NULL, path, NULL), STATUS_OK);
                assert_int_equal(file_read_all(path, SIZE_MAX / 2, &data[p], &n_byte[p], NULL), STATUS_OK);
            }
            assert_int_equal(n_byte[0], n_byte[1]);
            assert_memory_equal(data[0], data[1], n_byte[0]);
            check_file(&c, axis, data[0], n_byte[0]);
            free(data[0]);
            free(data[1]);
        }
        slice_codes_release(&c);
        volume_release(&v);
        direction_volume_release(&d);
    }
    thread_pool_free(pool);
}

/* 5 x 4 x 3 voxels become 3 x 2 x 2. */
static void test_large_scans_are_shrunk(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct slice_codes c;
    const size_t n[3] = {5, 4, 3};
    make_scan(n, &v, &d);
    assert_int_equal(slice_codes_make(&v, &d, 59, NULL, NULL, &c, NULL), STATUS_OK);
    assert_int_equal(c.factor, 2);
    assert_int_equal(c.n[0], 3);
    assert_int_equal(c.n[1], 2);
    assert_int_equal(c.n[2], 2);
    assert_true(fabs(c.voxel_size_m[2] - 6e-6) < 1e-12);
    /* the last voxel is one voxel of the scan wide and high, and two deep */
    size_t low = volume_index(n, 4, 2, 2), high = volume_index(n, 4, 3, 2);
    float mean = 0.5f * (fminf(1.0f, v.density[low]) + fminf(1.0f, v.density[high]));
    assert_int_equal(c.density[volume_index(c.n, 2, 1, 1)], lrintf(SLICE_DENSITY_STEPS * mean));
    d.n[0] = 4;
    slice_codes_release(&c);
    assert_int_equal(slice_codes_make(&v, &d, 59, NULL, NULL, &c, NULL), STATUS_INVALID);
    slice_codes_release(&c);
    d.n[0] = 5;
    volume_release(&v);
    direction_volume_release(&d);
}

static void test_halving(void **state)
{
    (void)state;
    const uint8_t density[6] = {10, 13, 3, 12, 30, 8}, direction[6] = {5, 7, 0, 9, 0, 0};
    uint8_t half[2], toward[2];
    slice_codes_halve(density, direction, 3, 2, half, toward);
    assert_int_equal(half[0], 16); /* 65 / 4 */
    assert_int_equal(half[1], 6);  /* 11 / 2, rounded up */
    assert_int_equal(toward[0], 7);
    assert_int_equal(toward[1], 0);
}

static void test_no_folder(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct slice_codes c;
    struct error err = {0};
    const size_t n[3] = {2, 2, 2};
    make_scan(n, &v, &d);
    assert_int_equal(slice_codes_make(&v, &d, 100, NULL, NULL, &c, NULL), STATUS_OK);
    assert_int_equal(slice_tiles_write(&c, 0, NULL, NULL, "/no/such/x.slices", &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "x.slices"));
    slice_codes_release(&c);
    volume_release(&v);
    direction_volume_release(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_direction_codes), cmocka_unit_test(test_files),
                                       cmocka_unit_test(test_large_scans_are_shrunk), cmocka_unit_test(test_halving),
                                       cmocka_unit_test(test_no_folder)};
    return cmocka_run_group_tests(tests, make_folder, NULL);
}
