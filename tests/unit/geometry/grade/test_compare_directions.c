/* The comparison of a direction volume with true fibers, on a field whose errors are known, and with it the rule of
 * the direction transfer (fabric thesis 5.6.7): voxels up to two radii away take the direction of the true fiber. */
#include "base/angle.h"
#include "geometry/grade/compare_directions.h"
#include "geometry/reconstruct/reconstruct.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_FIBER = 2, NX = 60, NY = 40, NZ = 30 };

static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
static const size_t n_voxel[3] = {NX, NY, NZ};
/* Fibers along x: y and z of the axis, and the radius, in voxels. The second lies at the seam of the tile. */
static const double fiber[N_FIBER][3] = {{20.0, 15.2, 3.6}, {0.4, 14.7, 2.8}};

static void make_fibers(struct fiber_set *f)
{
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, N_FIBER, 2 * N_FIBER, NULL), STATUS_OK);
    f->tile_size_m[0] = NX * voxel_m[0];
    f->tile_size_m[1] = NY * voxel_m[1];
    for (size_t i = 0; i < N_FIBER; i++) {
        for (size_t end = 0; end < 2; end++) {
            float *p = &f->position_m[3 * (2 * i + end)];
            p[0] = (float)((double)end * NX * voxel_m[0]);
            p[1] = (float)(fiber[i][0] * voxel_m[1]);
            p[2] = (float)(fiber[i][1] * voxel_m[2]);
        }
        f->first_vertex[i + 1] = 2 * (i + 1);
        f->radius_m[i] = (float)(fiber[i][2] * voxel_m[0]);
        f->axis_class[i] = 0;
    }
}

/* Distance of a voxel's centre from the nearest axis, in radii of its fiber, periodic in y. */
static double radii_away(size_t y, size_t z)
{
    double nearest = INFINITY, away = INFINITY;
    for (int i = 0; i < N_FIBER; i++) {
        double dy = (double)y + 0.5 - fiber[i][0], d = hypot(dy - NY * rint(dy / NY), (double)z + 0.5 - fiber[i][1]);
        away = d < nearest ? d / fiber[i][2] : away;
        nearest = fmin(d, nearest);
    }
    return away;
}

/* All voxels are kept but those at the bottom. Directions are off by `inside_deg` in fibers with even x and by twice
 * that with odd x, and by rim_deg outside of fibers; the sign changes from voxel to voxel, for it does not count. */
static void make_directions(struct direction_volume *d, double inside_deg, double rim_deg)
{
    assert_int_equal(direction_volume_init(d, n_voxel, voxel_m, NULL), STATUS_OK);
    for (size_t at = 0; at < (size_t)NX * NY * NZ; at++) {
        size_t x = at % NX, y = at / NX % NY, z = at / (NX * NY);
        double error_deg = radii_away(y, z) > 1.0 ? rim_deg : inside_deg * (x % 2 == 0 ? 1.0 : 2.0);
        float sign = at % 3 == 0 ? -1.0f : 1.0f;
        const float t[3] = {sign * (float)cos(error_deg * RAD_PER_DEG), 0.0f,
                            sign * (float)sin(error_deg * RAD_PER_DEG)};
        d->density[at] = z < 14 ? 0 : 200;
        direction_volume_set(d, at, t);
    }
}

static void test_known_errors(void **state)
{
    (void)state;
    struct fiber_set f;
    struct direction_volume d;
    struct direction_compare c = {0};
    size_t n[2] = {0, 0}, n_kept[2] = {0, 0};
    make_fibers(&f);
    make_directions(&d, 10.0, 50.0);
    assert_int_equal(compare_directions(&f, &d, NULL, &c, NULL), STATUS_OK);
    for (size_t z = 0; z < NZ; z++)
        for (size_t y = 0; y < NY; y++) {
            double away = radii_away(y, z);
            if (away > 2.0) continue;
            n[away > 1.0] += NX;
            n_kept[away > 1.0] += z < 14 ? 0 : NX;
        }
    assert_int_equal(c.inside.n, n_kept[0]);
    assert_int_equal(c.rim.n, n_kept[1]);
    assert_true(fabs(c.inside.mean_deg - 15.0) < 0.01 && fabs(c.inside.p95_deg - 20.0) < 0.11);
    assert_true(fabs(c.rim.mean_deg - 50.0) < 0.01 && fabs(c.rim.p95_deg - 50.0) < 0.11);
    assert_true(fabs(c.kept_share - (double)n_kept[0] / (double)n[0]) < 1e-12);
    direction_volume_release(&d);
    fiber_set_release(&f);
}

static void test_without_kept_voxels(void **state)
{
    (void)state;
    struct fiber_set f;
    struct direction_volume d;
    struct direction_compare c = {0};
    make_fibers(&f);
    make_directions(&d, 10.0, 50.0);
    memset(d.density, 0, (size_t)NX * NY * NZ);
    assert_int_equal(compare_directions(&f, &d, NULL, &c, NULL), STATUS_OK);
    assert_true(isnan(c.inside.mean_deg) && isnan(c.rim.p95_deg) && c.inside.n == 0 && c.kept_share == 0.0);
    direction_volume_release(&d);
    fiber_set_release(&f);
}

/* The transfer reaches all of the rim and nothing beyond. */
static void test_transfer_reaches_the_rim(void **state)
{
    (void)state;
    struct fiber_set f;
    struct direction_volume d;
    struct reconstruct_report report = {0};
    struct direction_compare before = {0}, after = {0};
    make_fibers(&f);
    make_directions(&d, 10.0, 50.0);
    assert_int_equal(compare_directions(&f, &d, NULL, &before, NULL), STATUS_OK);
    assert_int_equal(reconstruct_transfer(&f, &d, NULL, NULL, &report, NULL), STATUS_OK);
    assert_int_equal(compare_directions(&f, &d, NULL, &after, NULL), STATUS_OK);
    assert_true(after.rim.n >= before.rim.n); /* voxels that a fiber fills in part are no longer empty */
    assert_true(before.rim.mean_deg > 49.0);
    /* the half of the second fiber beyond the seam has no line of its own in the volume */
    size_t beyond = 0;
    for (size_t z = 14; z < NZ; z++)
        for (size_t y = NY / 2; y < NY; y++) {
            double d_second = hypot((double)y + 0.5 - NY - fiber[1][0], (double)z + 0.5 - fiber[1][1]) / fiber[1][2];
            beyond += d_second > 1.0 && d_second <= 2.0 ? NX : 0;
        }
    double expected = 50.0 * (double)beyond / (double)after.rim.n;
    assert_true(beyond > 0 && fabs(after.rim.mean_deg - expected) < 0.02);
    direction_volume_release(&d);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_known_errors), cmocka_unit_test(test_without_kept_voxels),
                                       cmocka_unit_test(test_transfer_reaches_the_rim)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
