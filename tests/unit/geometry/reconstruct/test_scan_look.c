/* Padding of scans: fields of view of many shapes and values are found, and void is never taken for one. */
#include "geometry/reconstruct/scan_look.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { NX = 40, NY = 36, NZ = 24, N = NX * NY * NZ };

static float scan[N];

static double random_unit(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8) / (double)(1u << 24);
}

/* Fibers along z, three by three, with noise: void at 2000, solid at 4000. */
static void draw(double noise)
{
    uint32_t seed = 7;
    for (int i = 0; i < N; i++) {
        const double x = fmod(i % NX, 12.0) - 6.0, y = fmod(i / NX % NY, 12.0) - 6.0;
        const double solid = fmin(1.0, fmax(0.0, 4.5 - hypot(x, y)));
        scan[i] = (float)rint(2000.0 + 2000.0 * solid + noise * (random_unit(&seed) + random_unit(&seed) - 1.0));
    }
}

static struct scan_look look_at(void **state, const char *type)
{
    const char *path = scratch_path(state, "look.raw");
    struct volume_raw_declaration raw = {.n = {NX, NY, NZ}};
    struct volume_source *source = NULL;
    struct scan_look look;
    snprintf(raw.type, sizeof raw.type, "%s", type);
    scratch_write(path, scan, sizeof scan);
    assert_int_equal(volume_source_open_declared(&path, 1, &raw, NULL, &source, NULL), STATUS_OK);
    assert_int_equal(scan_look_take(source, &look, NULL), STATUS_OK);
    volume_source_close(source);
    return look;
}

/* Fields of view: whether voxel (x, y, z) lies in it. */
static bool in_cylinder(int x, int y, int z) { return (void)z, hypot(x - 19.5, y - 17.5) < 18.0; }
static bool in_box(int x, int y, int z) { return x >= 3 && x < 36 && y >= 2 && y < 33 && z >= 0; }
static bool in_tilted_box(int x, int y, int z)
{
    const double u = 0.97 * (x - 20) + 0.24 * (y - 18), w = 0.24 * (20 - x) + 0.97 * (y - 18);
    return fabs(u) < 16.0 && fabs(w) < 14.0 && z >= 0;
}
static bool in_slices(int x, int y, int z) { return x >= 0 && y >= 0 && z >= 4 && z < 21; }
static bool in_tilted_slices(int x, int y, int z) { return y >= 0 && fabs(z - 12.0 + 0.15 * (x - 20)) < 9.0; }

static void test_fields_of_view(void **state)
{
    static bool (*const inside[])(int, int, int) = {in_cylinder, in_box, in_tilted_box, in_slices, in_tilted_slices};
    static const float code[] = {-32768.0f, 0.0f, 65535.0f, NAN, INFINITY, -INFINITY, 1e30f};
    for (size_t f = 0; f < sizeof inside / sizeof *inside; f++)
        for (size_t c = 0; c < sizeof code / sizeof *code; c++) {
            size_t n = 0;
            draw(600.0);
            for (int i = 0; i < N; i++)
                if (!inside[f](i % NX, i / NX % NY, i / NX / NY)) {
                    scan[i] = code[c];
                    n++;
                }
            const struct scan_look look = look_at(state, "float32");
            if (look.n_padding != 1) fail_msg("field %zu, code %g: %zu found", f, (double)code[c], look.n_padding);
            assert_true(scan_look_is_padding(&look, code[c]) && !scan_look_is_padding(&look, 2000.0f));
            assert_true(fabs(look.share[0] - (double)n / N) < 0.03);
            assert_true(look.least > 1000.0 && look.most < 5000.0 && !look.has_unnumbered);
        }
}

/* Zero outside of a round view whose void has values down to 12 of 255, as 8-bit exports have; and zero that clips the
 * same noise. */
static void test_near_the_noise(void **state)
{
    for (int clipped = 0; clipped < 2; clipped++) {
        draw(800.0);
        for (int i = 0; i < N; i++) {
            const float v = rintf((scan[i] - 800.0f) / 14.0f);
            scan[i] = fmaxf(clipped ? 0.0f : 12.0f, clipped ? v - 80.0f : v);
            if (!in_cylinder(i % NX, i / NX % NY, 0)) scan[i] = 0.0f;
        }
        const struct scan_look look = look_at(state, "float32");
        assert_int_equal(look.n_padding, clipped ? 0 : 1);
    }
}

static void test_two_codes(void **state)
{
    draw(600.0);
    for (int i = 0; i < N; i++)
        if (!in_slices(i % NX, i / NX % NY, i / NX / NY))
            scan[i] = NAN;
        else if (!in_cylinder(i % NX, i / NX % NY, 0))
            scan[i] = -1000.0f;
    const struct scan_look look = look_at(state, "float32");
    assert_int_equal(look.n_padding, 2);
    assert_true(scan_look_is_padding(&look, NAN) && scan_look_is_padding(&look, -1000.0f));
}

/* Void that was set to zero by a threshold or a mask, clipped values, labels, and plain scans. */
static void test_void_is_no_padding(void **state)
{
    for (int kind = 0; kind < 7; kind++) {
        draw(kind == 5 ? 0.0 : 600.0);
        for (int i = 0; i < N; i++) {
            const float v = scan[i];
            const int z = i / NX / NY;
            if (kind == 1) scan[i] = v < 3000.0f ? 0.0f : v;         /* a mask of the material */
            if (kind == 2) scan[i] = fmaxf(0.0f, v - 2100.0f);       /* clipped void */
            if (kind == 3) scan[i] = v < 3000.0f ? 0.0f : 1.0f;      /* labels */
            if (kind == 4 && (z < 8 || z > 15)) scan[i] = 0.0f;      /* thick void without noise ... */
            if (kind == 4) scan[i] = fmaxf(0.0f, scan[i] - 2000.0f); /* ... above clipped void */
            if (kind == 6) scan[i] = fminf(3900.0f, v);              /* saturated material */
        }
        const struct scan_look look = look_at(state, "float32");
        if (look.n_padding != 0) fail_msg("kind %d: %g is taken for padding", kind, (double)look.padding[0]);
    }
}

/* A lone value that is no number is a fault of the scan. */
static void test_single_voxels(void **state)
{
    draw(600.0);
    for (int k = 0; k < NZ; k++) scan[k * NX * NY + NX * 18 + 20] = NAN;
    const struct scan_look look = look_at(state, "float32");
    assert_true(look.n_padding == 0 && look.has_unnumbered);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fields_of_view), cmocka_unit_test(test_near_the_noise),
        cmocka_unit_test(test_two_codes),      cmocka_unit_test(test_void_is_no_padding),
        cmocka_unit_test(test_single_voxels),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
