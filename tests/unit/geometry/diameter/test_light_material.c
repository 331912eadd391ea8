/* Fibers of a lighter material: found and raised beside dense ones, while scans of one material stay as they are; and
 * the kinds that the fibers are then sorted into. */
#include "geometry/diameter/light_material.h"

#include "base/rng.h"
#include "geometry/grade/fiber_kinds.h"
#include "geometry/phantom/phantom.h"
#include "geometry/volume/density_map.h"
#include "geometry/volume/voxel_runs.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const size_t n_voxel[3] = {80, 72, 60};
static const double voxel_m = 2e-6;

/* A straight line through the whole scan: along x at (y, z) = place, or along y at (x, z) = place. */
struct rod {
    int axis;
    double place[2], radius, density;
};

static struct fiber_set fibers_of(const struct rod *rod, size_t n)
{
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, n, 2 * n, NULL), STATUS_OK);
    for (size_t a = 0; a < 2; a++) f.tile_size_m[a] = voxel_m * (double)n_voxel[a];
    for (size_t i = 0; i < n; i++) {
        const size_t along = (size_t)rod[i].axis, across = 1 - along;
        f.first_vertex[i + 1] = 2 * (i + 1);
        f.radius_m[i] = (float)(rod[i].radius * voxel_m);
        for (size_t end = 0; end < 2; end++) {
            float *p = f.position_m + 6 * i + 3 * end;
            p[along] = (float)(voxel_m * (double)n_voxel[along] * (double)end);
            p[across] = (float)(voxel_m * rod[i].place[0]);
            p[2] = (float)(voxel_m * rod[i].place[1]);
        }
    }
    return f;
}

/* A scan of rods with noise of a fifth of the step. */
static struct volume scan_of(const struct rod *rod, size_t n)
{
    struct volume v;
    const double size[3] = {voxel_m, voxel_m, voxel_m};
    const struct rng_key key = {.seed = 5};
    assert_int_equal(volume_init(&v, n_voxel, size, NULL), STATUS_OK);
    for (size_t i = 0; i < n; i++) {
        struct phantom_scan_option o;
        struct volume one;
        struct fiber_set f = fibers_of(rod + i, 1);
        phantom_scan_option_default(&o);
        o.blur_sd_voxel = 0.7;
        o.snr = 0.0;
        assert_int_equal(phantom_scan(&f, n_voxel, &o, NULL, NULL, &one, NULL), STATUS_OK);
        for (size_t k = 0; k < volume_n_voxel(n_voxel); k++) v.density[k] += (float)rod[i].density * one.density[k];
        volume_release(&one);
        fiber_set_release(&f);
    }
    for (size_t k = 0; k < volume_n_voxel(n_voxel); k++) {
        struct rng rng;
        double normal[2];
        rng_start(&rng, &key, (uint32_t)k, 0);
        rng_normal_pair(&rng, normal);
        v.density[k] += (float)(0.2 * normal[0]);
    }
    return v;
}

static double density_on_axis(const struct volume *v, const struct rod *rod)
{
    const size_t along = (size_t)rod->axis;
    double sum = 0.0;
    for (size_t i = 0; i < n_voxel[along]; i++) {
        size_t x[3] = {(size_t)rod->place[0], (size_t)rod->place[0], (size_t)rod->place[1]};
        x[along] = i;
        sum += (double)v->density[volume_index(n_voxel, x[0], x[1], x[2])];
    }
    return sum / (double)n_voxel[along];
}

/* Dense rods along x, and light ones along y that cross them, one of which touches them. */
static const struct rod two_materials[] = {{0, {12, 12}, 3.5, 1.0},  {0, {36, 12}, 3.5, 1.0},
                                           {0, {60, 12}, 3.5, 1.0},  {1, {12, 19}, 3.5, 0.35},
                                           {1, {40, 40}, 3.5, 0.35}, {1, {64, 48}, 3.5, 0.35}};
enum { N_DENSE = 3, N_ROD = 6 };

static void test_light_fibers_become_dense(void **state)
{
    (void)state;
    struct light_material m;
    struct volume v = scan_of(two_materials, N_ROD), was = scan_of(two_materials, N_ROD);
    assert_int_equal(light_material_raise(&v, 0.0, 1.0, NULL, &m, NULL), STATUS_OK);
    print_message("density %.3f, share %.3f, high %.3f\n", m.density, m.share, m.high);
    assert_true(fabs(m.density - 0.35) < 0.05 && m.high == 1.0 && v.light.density == m.density);
    for (size_t i = 0; i < N_ROD; i++) {
        const double density = density_on_axis(&v, &two_materials[i]);
        print_message("rod %zu: %.3f\n", i, density);
        assert_true(fabs(density - 1.0) < 0.15);
    }
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++)
        if (!voxel_runs_hold(v.light.run, v.light.n, i)) assert_true(v.density[i] == was.density[i]);
    volume_release(&v);
    volume_release(&was);
}

/* Values of a scanner, with so many light fibers that the value given for dense ones is theirs. */
static void test_value_of_dense_fibers_is_found(void **state)
{
    (void)state;
    struct light_material m;
    struct volume v = scan_of(two_materials, N_ROD);
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) v.density[i] = 500.0f + 2000.0f * v.density[i];
    assert_int_equal(light_material_raise(&v, 500.0, 500.0 + 0.4 * 2000.0, NULL, &m, NULL), STATUS_OK);
    print_message("density %.3f, high %.0f\n", m.density, m.high);
    assert_true(fabs(m.density - 0.35) < 0.05 && fabs(m.high - 2500.0) < 200.0);
    assert_true(fabs(density_on_axis(&v, &two_materials[4]) - 2500.0) < 300.0);
    volume_release(&v);
}

static void check_stays(const struct rod *rod, size_t n)
{
    struct light_material m;
    struct volume v = scan_of(rod, n), was = scan_of(rod, n);
    assert_int_equal(light_material_raise(&v, 0.0, 1.0, NULL, &m, NULL), STATUS_OK);
    assert_true(isnan(m.density) && v.light.n == 0);
    assert_memory_equal(v.density, was.density, volume_n_voxel(n_voxel) * sizeof *v.density);
    volume_release(&v);
    volume_release(&was);
}

static void test_one_material_stays(void **state)
{
    (void)state;
    const struct rod thin[] = {{0, {12, 12}, 5.0, 1.0}, {0, {36, 12}, 5.0, 1.0}, {1, {12, 30}, 1.5, 1.0},
                               {1, {30, 40}, 1.5, 1.0}, {1, {50, 40}, 1.5, 1.0}, {1, {66, 48}, 1.5, 1.0}};
    const struct rod gradual[] = {{0, {12, 12}, 3.5, 1.0}, {0, {30, 12}, 3.5, 0.85}, {0, {48, 12}, 3.5, 0.7},
                                  {0, {12, 36}, 3.5, 0.6}, {0, {30, 36}, 3.5, 0.5},  {0, {48, 36}, 3.5, 0.4}};
    check_stays(two_materials, N_DENSE);
    check_stays(thin, 6);
    check_stays(gradual, 6);
}

static void test_fibers_are_sorted_into_kinds(void **state)
{
    (void)state;
    struct rod rod[N_ROD];
    struct fiber_kinds kinds;
    struct light_material m;
    memcpy(rod, two_materials, sizeof rod);
    struct volume v = scan_of(rod, N_ROD);
    rod[0].radius = rod[1].radius = 5.5; /* in place of 3.5 */
    struct fiber_set f = fibers_of(rod, N_ROD);
    assert_int_equal(fiber_kinds_measure(&v, &f, 0.2e-6, 0.1e-6, &kinds, NULL), STATUS_OK);
    assert_true(kinds.n == 2 && kinds.kind[0].n_fiber == 2 && kinds.kind[1].n_fiber == 4);
    assert_int_equal(light_material_raise(&v, 0.0, 1.0, NULL, &m, NULL), STATUS_OK);
    for (size_t i = 0; i < N_ROD; i++) /* a light fiber is told by its vertices, and the ends lie in the faces */
        assert_true(f.first_vertex[i + 1] - f.first_vertex[i] == 2);
    assert_int_equal(fiber_kinds_measure(&v, &f, 0.2e-6, 0.1e-6, &kinds, NULL), STATUS_OK);
    assert_true(kinds.n == 3);
    const double all = 3.0 * (double)n_voxel[0] + 3.0 * (double)n_voxel[1];
    const double radius_m[3] = {5.5 * voxel_m, 3.5 * voxel_m, 3.5 * voxel_m};
    const double share[3] = {2.0 * (double)n_voxel[0] / all, (double)n_voxel[0] / all, 3.0 * (double)n_voxel[1] / all};
    const size_t n[3] = {2, 1, 3};
    for (size_t k = 0; k < 3; k++) {
        assert_true(fabs(kinds.kind[k].radius_m - radius_m[k]) < 1e-9 && kinds.kind[k].n_fiber == n[k]);
        assert_true(fabs(kinds.kind[k].share - share[k]) < 1e-6);
        assert_true(kinds.kind[k].density == (k < 2 ? 1.0 : m.density));
        assert_true(fabs(kinds.kind[k].radius_se_m - hypot(0.2e-6 / sqrt((double)n[k]), 0.1e-6)) < 1e-12);
    }
    fiber_set_release(&f);
    volume_release(&v);
}

static void test_marks_far_and_small(void **state)
{
    (void)state;
    enum { N = 11 };
    const size_t n[3] = {N, N, N};
    static uint8_t mark[N * N * N], work[N * N * N], square[N * N * N];
    const size_t at = volume_index(n, 5, 4, 3);
    memset(mark, 0, sizeof mark);
    mark[at] = 2;
    mark[volume_index(n, 0, 0, 0)] = 1;
    assert_int_equal(voxel_marks_distance(n, mark, 2, 3, NULL, work, square, NULL), STATUS_OK);
    for (size_t k = 0; k < N; k++)
        for (size_t j = 0; j < N; j++)
            for (size_t i = 0; i < N; i++) {
                const long d[3] = {(long)i - 5, (long)j - 4, (long)k - 3};
                const long true2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                const long found = square[volume_index(n, i, j, k)];
                assert_true(true2 < 16 ? found == true2 : found >= 16);
            }
    /* sets of 1 and 3 voxels; the last voxel of a row, and of a slice, is not beside the first one of the next */
    mark[at] = mark[at + N] = mark[at + N + N * N] = 1;
    mark[volume_index(n, N - 1, 7, 7)] = mark[volume_index(n, 0, 8, 7)] = mark[volume_index(n, 2, N - 1, 8)] =
        mark[volume_index(n, 2, 0, 9)] = 1;
    assert_int_equal(voxel_marks_drop_small(n, 2, mark, NULL), STATUS_OK);
    for (size_t i = 0; i < sizeof mark; i++) assert_int_equal(mark[i], i == at || i == at + N || i == at + N + N * N);
}

/* A ball, a cylinder of five diameters, and a ball that is too large. */
static void test_compact_sets_are_counted(void **state)
{
    (void)state;
    enum { X = 64, Y = 40, Z = 40 };
    static const size_t n[3] = {X, Y, Z};
    static uint8_t mark[X * Y * Z];
    size_t count = 0, n_ball = 0;
    for (size_t i = 0; i < sizeof mark; i++) {
        const double x = (double)(i % X), y = (double)(i / X % Y), z = (double)(i / (X * Y));
        const bool ball = hypot(hypot(x - 8.0, y - 8.0), z - 8.0) < 4.0,
                   large = hypot(hypot(x - 50.0, y - 26.0), z - 26.0) < 9.0,
                   cylinder = hypot(y - 30.0, z - 8.0) < 3.0 && x > 2.0 && x < 33.0;
        mark[i] = ball || large || cylinder;
        n_ball += ball;
    }
    assert_int_equal(voxel_marks_count_compact(n, mark, 0.17, 6.0, &count, NULL), STATUS_OK);
    assert_int_equal(count, n_ball);
    assert_int_equal(voxel_marks_count_compact(n, mark, 0.1, 20.0, &count, NULL), STATUS_OK);
    size_t n_all = 0;
    for (size_t i = 0; i < sizeof mark; i++) n_all += mark[i];
    assert_int_equal(count, n_all);
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_light_fibers_become_dense), cmocka_unit_test(test_value_of_dense_fibers_is_found),
        cmocka_unit_test(test_one_material_stays),        cmocka_unit_test(test_fibers_are_sorted_into_kinds),
        cmocka_unit_test(test_marks_far_and_small),       cmocka_unit_test(test_compact_sets_are_counted),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
