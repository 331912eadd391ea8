/* The grade of a scan: bundles that the scan resolves, bundles that are blurred together, fibers invented in a block of
 * material, hollow fibers, and single fibers. */
#include "geometry/grade/scan_grade.h"
#include "geometry/phantom/phantom.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const size_t n_voxel[3] = {60, 42, 42};
static const double voxel_m = 2e-6;

/* n x n straight fibers along x, spacing apart, in voxels. */
static struct fiber_set bundle(size_t n, double spacing, double radius)
{
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, n * n, 2 * n * n, NULL), STATUS_OK);
    f.tile_size_m[0] = voxel_m * (double)n_voxel[0];
    f.tile_size_m[1] = voxel_m * (double)n_voxel[1];
    for (size_t i = 0; i < n * n; i++) {
        f.first_vertex[i + 1] = 2 * (i + 1);
        f.radius_m[i] = (float)(radius * voxel_m);
        for (size_t end = 0; end < 2; end++) {
            float *p = f.position_m + 3 * (2 * i + end);
            p[0] = (float)(voxel_m * (end == 0 ? 0.0 : (double)n_voxel[0]));
            p[1] = (float)(voxel_m * (21.3 + spacing * ((double)(i % n) - 0.5 * (double)(n - 1))));
            p[2] = (float)(voxel_m * (20.9 + spacing * ((double)(i / n) - 0.5 * (double)(n - 1))));
        }
    }
    return f;
}

static struct scan_grade grade_of(const struct fiber_set *scanned, const struct fiber_set *traced, double blur,
                                  double lumen, float *safe)
{
    struct phantom_scan_option o;
    struct volume v;
    struct scan_grade g[2];
    struct thread_pool *pool;
    phantom_scan_option_default(&o);
    o.blur_sd_voxel = blur;
    o.section.lumen = lumen;
    assert_int_equal(phantom_scan(scanned, n_voxel, &o, NULL, NULL, &v, NULL), STATUS_OK);
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    assert_int_equal(scan_grade_measure(&v, traced, NULL, NULL, &g[0], safe, NULL), STATUS_OK);
    assert_int_equal(scan_grade_measure(&v, traced, pool, NULL, &g[1], NULL, NULL), STATUS_OK);
    thread_pool_free(pool);
    assert_true(g[0].verdict == g[1].verdict);
    assert_true(g[0].safe_share == g[1].safe_share || isnan(g[0].safe_share));
    volume_release(&v);
    print_message("blur %g, lumen %g: %s, contrast %.2f, valley %.2f, beside %.2f, safe %.2f\n", blur, lumen,
                  grade_verdict_name(g[0].verdict), g[0].contrast, g[0].valley_depth, g[0].beside_share,
                  g[0].safe_share);
    return g[0];
}

static void test_a_bundle_and_its_blur(void **state)
{
    (void)state;
    struct fiber_set f = bundle(4, 8.0, 3.5);
    float safe[16];
    struct scan_grade sharp = grade_of(&f, &f, 0.7, 0.0, safe), blurred = grade_of(&f, &f, 4.0, 0.0, NULL);
    assert_int_equal(sharp.verdict, GRADE_RESOLVED);
    assert_true(sharp.valley_depth > 0.4 && sharp.beside_share > 0.95 && sharp.safe_share > 0.98);
    for (int i = 0; i < 16; i++) assert_true(safe[i] > 0.9f && safe[i] < 1.001f);
    assert_true(blurred.valley_depth < 0.15 && blurred.safe_share < sharp.safe_share);
    assert_int_equal(blurred.verdict, GRADE_UNRESOLVED);
    fiber_set_release(&f);
}

/* Fibers farther apart than 1.6 sums of their radii are no neighbours, so nothing lies beside them. */
static void test_neighbours(void **state)
{
    (void)state;
    static const double spacing[] = {10.0, 13.0};
    for (int k = 0; k < 2; k++) {
        struct fiber_set f = bundle(2, spacing[k], 3.5);
        struct scan_grade g = grade_of(&f, &f, 0.7, 0.0, NULL);
        assert_true(k == 0 ? g.beside_share > 0.95 : g.beside_share == 0.0);
        fiber_set_release(&f);
    }
}

/* What a tracer makes of a tow whose fibers it cannot see: an even grid in a block of material. */
static void test_invented_fibers(void **state)
{
    (void)state;
    struct fiber_set block = bundle(8, 4.0, 2.9), invented = bundle(4, 7.0, 3.5);
    struct scan_grade g = grade_of(&block, &invented, 1.5, 0.0, NULL);
    assert_int_equal(g.verdict, GRADE_UNRESOLVED);
    assert_true(g.valley_depth < 0.15);
    fiber_set_release(&block);
    fiber_set_release(&invented);
}

/* Fibers pressed together have hardly a valley, but the scan shows them. */
static void test_pressed_fibers(void **state)
{
    (void)state;
    struct fiber_set f = bundle(4, 7.0, 3.5);
    struct scan_grade g = grade_of(&f, &f, 0.7, 0.0, NULL);
    assert_int_equal(g.verdict, GRADE_RESOLVED);
    assert_true(g.contrast > 0.8);
    fiber_set_release(&f);
}

static void test_hollow_and_single_fibers(void **state)
{
    (void)state;
    struct fiber_set f = bundle(3, 9.0, 4.0), one = bundle(1, 1.0, 3.0);
    struct scan_grade hollow = grade_of(&f, &f, 0.7, 0.4, NULL), single = grade_of(&one, &one, 0.7, 0.0, NULL);
    assert_int_equal(hollow.verdict, GRADE_RESOLVED);
    assert_int_equal(single.verdict, GRADE_RESOLVED);
    assert_true(isnan(single.valley_depth) && single.contrast > 0.8 && single.beside_share == 0.0);
    fiber_set_release(&f);
    fiber_set_release(&one);
}

/* Fibers that are not there are left out, the others stay as they are. */
static void test_unseen_fibers_are_left_out(void **state)
{
    (void)state;
    struct fiber_set there = bundle(1, 1.0, 3.5), traced = bundle(2, 14.0, 3.5);
    float safe[4];
    for (int end = 0; end < 2; end++) /* the first of the traced fibers is the one that is there */
        for (int a = 0; a < 3; a++) traced.position_m[3 * end + a] = there.position_m[3 * end + a];
    struct scan_grade g = grade_of(&there, &traced, 0.7, 0.0, safe);
    assert_int_equal(g.verdict, GRADE_UNRESOLVED);
    const float turned[4] = {safe[1], safe[0], safe[2], safe[3]};
    assert_int_equal(scan_grade_sort(&traced, turned, &g, NULL), STATUS_OK); /* the second comes first */
    assert_int_equal(scan_grade_sort(&traced, turned, &g, NULL), STATUS_OK); /* and now the first again */
    assert_true(traced.n_fiber == 4 && traced.n_vertex == 8);
    scan_grade_drop(&traced, &g);
    assert_true(traced.n_fiber == 1 && traced.n_vertex == 2 && g.n_dropped == 3);
    assert_memory_equal(traced.position_m, there.position_m, 6 * sizeof(float));
    assert_int_equal(fiber_set_validate(&traced, NULL), STATUS_OK);
    safe[0] = 0.0f;
    assert_int_equal(scan_grade_sort(&traced, safe, &g, NULL), STATUS_OK); /* not all */
    scan_grade_drop(&traced, &g);
    assert_int_equal(traced.n_fiber, 1);
    fiber_set_release(&there);
    fiber_set_release(&traced);
}

/* Without fibers there is no grade. */
static void test_no_fibers(void **state)
{
    (void)state;
    struct fiber_set f = bundle(1, 1.0, 3.0), none;
    fiber_set_init(&none);
    assert_int_equal(fiber_set_reserve(&none, 0, 0, NULL), STATUS_OK);
    struct scan_grade g = grade_of(&f, &none, 0.7, 0.0, NULL);
    assert_int_equal(g.verdict, GRADE_NONE);
    fiber_set_release(&f);
    fiber_set_release(&none);
}

/* Of a fiber whose scan ends in the middle, the half without it has no contrast. */
static void test_contrast_along_a_fiber(void **state)
{
    (void)state;
    enum { N = 31 };
    struct fiber_set f;
    struct phantom_scan_option o;
    struct volume v;
    struct thread_pool *pool;
    float contrast[2][N];
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, N, NULL), STATUS_OK);
    f.tile_size_m[0] = voxel_m * (double)n_voxel[0];
    f.tile_size_m[1] = voxel_m * (double)n_voxel[1];
    f.first_vertex[1] = N;
    f.radius_m[0] = (float)(3.0 * voxel_m);
    for (size_t i = 0; i < N; i++) {
        f.position_m[3 * i] = (float)(voxel_m * 2.0 * (double)i);
        f.position_m[3 * i + 1] = f.position_m[3 * i + 2] = (float)(voxel_m * 21.0);
    }
    phantom_scan_option_default(&o);
    o.voxel_size_m = voxel_m;
    assert_int_equal(phantom_scan(&f, n_voxel, &o, NULL, NULL, &v, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++)
        if (i % n_voxel[0] >= n_voxel[0] / 2) v.density[i] = 0.0f;
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    assert_int_equal(scan_grade_contrast(&v, &f, NULL, NULL, contrast[0], NULL), STATUS_OK);
    assert_int_equal(scan_grade_contrast(&v, &f, pool, NULL, contrast[1], NULL), STATUS_OK);
    assert_memory_equal(contrast[0], contrast[1], sizeof contrast[0]);
    thread_pool_free(pool);
    for (size_t i = 0; i < 9; i++) {
        assert_true(contrast[0][i] > 0.8f);
        assert_true(fabsf(contrast[0][N - 1 - i]) < 0.1f);
    }
    volume_release(&v);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_bundle_and_its_blur),
        cmocka_unit_test(test_neighbours),
        cmocka_unit_test(test_invented_fibers),
        cmocka_unit_test(test_pressed_fibers),
        cmocka_unit_test(test_hollow_and_single_fibers),
        cmocka_unit_test(test_unseen_fibers_are_left_out),
        cmocka_unit_test(test_no_fibers),
        cmocka_unit_test(test_contrast_along_a_fiber),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
