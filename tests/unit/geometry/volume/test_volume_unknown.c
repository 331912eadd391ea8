/* Voxels without a measurement: they are found, densities continue into them in a copy, and results there are left
 * out. */
#include "geometry/volume/volume_align.h"
#include "geometry/volume/volume_unknown.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>

#include <cmocka.h>

enum { NX = 50, NY = 12, NZ = 10, BORDER = 9 };

/* A volume that is known for x < BORDER, where it has the density 0.25 below the middle of y, and 0.75 above. */
static struct volume half_known(void)
{
    struct volume v;
    const size_t n[3] = {NX, NY, NZ};
    assert_int_equal(volume_init(&v, n, (const double[3]){1e-6, 1e-6, 1e-6}, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(n); i++)
        v.density[i] = i % NX >= BORDER ? VOLUME_OUTSIDE : i / NX % NY < NY / 2 ? 0.25f : 0.75f;
    assert_int_equal(volume_mark_unknown(&v, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(n); i++)
        if (v.density[i] == VOLUME_OUTSIDE) v.density[i] = 0.0f; /* as the mapping of densities does */
    return v;
}

static void test_runs(void **state)
{
    (void)state;
    struct volume v = half_known();
    assert_int_equal(v.unknown.n, NY * NZ);
    for (size_t r = 0; r < v.unknown.n; r++) {
        assert_int_equal(v.unknown.run[r].first, r * NX + BORDER);
        assert_int_equal(v.unknown.run[r].end, (r + 1) * NX);
    }
    volume_release(&v);
    assert_null(v.unknown.run);
}

static void test_near(void **state)
{
    (void)state;
    struct volume v = half_known();
    const struct {
        float x[3], reach;
        bool near;
    } place[] = {{{8.5f, 3.0f, 3.0f}, 0.0f, false},    {{9.1f, 3.0f, 3.0f}, 0.0f, true},
                 {{6.4f, 3.0f, 3.0f}, 2.5f, false},    {{6.6f, 3.0f, 3.0f}, 2.5f, true},
                 {{-1.0f, -1.0f, -1.0f}, 0.0f, false}, {{0.0f, 12.0f, 10.0f}, 3.0f, false},
                 {{51.0f, 12.0f, 10.0f}, 0.0f, true}};
    for (size_t i = 0; i < sizeof place / sizeof *place; i++)
        if (volume_unknown_near(&v, place[i].x, place[i].reach) != place[i].near) fail_msg("place %zu", i);
    volume_release(&v);
    struct volume whole;
    assert_int_equal(volume_init(&whole, (const size_t[3]){4, 4, 4}, (const double[3]){1e-6, 1e-6, 1e-6}, NULL),
                     STATUS_OK);
    assert_int_equal(volume_mark_unknown(&whole, NULL), STATUS_OK);
    assert_int_equal(whole.unknown.n, 0);
    assert_false(volume_unknown_near(&whole, (const float[3]){1.0f, 1.0f, 1.0f}, 9.0f));
    volume_release(&whole);
}

/* Densities continue straight across the border, and far from it there are none. The volume itself stays. */
static void test_continued(void **state)
{
    (void)state;
    struct volume v = half_known(), to;
    assert_int_equal(volume_continue(&v, &to, NULL), STATUS_OK);
    assert_int_equal(to.unknown.n, 0);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) {
        const size_t x = i % NX, y = i / NX % NY;
        if (x < BORDER) assert_true(to.density[i] == v.density[i]);
        if (x >= BORDER) assert_true(v.density[i] == 0.0f);
        if (x >= BORDER + VOLUME_CONTINUED_VOXELS) assert_true(to.density[i] == 0.0f);
        if (x < BORDER || x >= BORDER + VOLUME_CONTINUED_VOXELS) continue;
        assert_true(to.density[i] >= 0.249f && to.density[i] <= 0.751f);
        if (x < BORDER + 4 && (y < 2 || y >= NY - 2)) /* far from where the densities change */
            assert_float_equal(to.density[i], y < 2 ? 0.25f : 0.75f, 1e-6);
    }
    volume_unknown_ignore(&v, &to);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++)
        assert_true(to.density[i] == (i % NX < BORDER ? v.density[i] : VOLUME_IGNORED));
    volume_release(&to);
    volume_release(&v);
}

static void test_directions_are_emptied(void **state)
{
    (void)state;
    struct volume v = half_known();
    struct direction_volume d;
    assert_int_equal(direction_volume_init(&d, v.n, v.voxel_size_m, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) d.density[i] = 200;
    volume_unknown_empty(&v, &d);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) assert_int_equal(d.density[i], i % NX < BORDER ? 200 : 0);
    direction_volume_release(&d);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_runs),
        cmocka_unit_test(test_near),
        cmocka_unit_test(test_continued),
        cmocka_unit_test(test_directions_are_emptied),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
