/* Direction transfer (fabric thesis 5.6.7) against distances computed here: a kept voxel within 2 r of the axis of a
 * fiber takes that fiber's direction, all others keep theirs, but for empty ones that a fiber fills in part; the
 * share of fibers that is material counts voxels within r. Densities are the shares of the voxels that fibers fill.
 * In a scan that does not resolve fibers, directions are means over those around. */
#include "geometry/reconstruct/reconstruct.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_FIBER = 2, NX = 40, NY = 40, NZ = 24 };

static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
static const size_t n_voxel[3] = {NX, NY, NZ};
/* Fibers along x of different radii: y and z of the axis, and the radius, in voxels. */
static const double fiber[N_FIBER][3] = {{10.3, 11.6, 2.6}, {28.4, 12.2, 3.7}};
static const float before[3] = {0.0f, 0.6f, 0.8f};

static void make_fibers(struct fiber_set *f)
{
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, N_FIBER, 2 * N_FIBER, NULL), STATUS_OK);
    f->tile_size_m[0] = NX * voxel_m[0];
    f->tile_size_m[1] = NY * voxel_m[1];
    for (size_t i = 0; i < N_FIBER; i++) {
        for (size_t end = 0; end < 2; end++) {
            float *p = &f->position_m[3 * (2 * i + end)];
            p[0] = (float)(((double)end * (NX + 20.0) - 10.0) * voxel_m[0]); /* its ends lie far outside */
            p[1] = (float)(fiber[i][0] * voxel_m[1]);
            p[2] = (float)(fiber[i][1] * voxel_m[2]);
        }
        f->first_vertex[i + 1] = 2 * (i + 1);
        f->radius_m[i] = (float)(fiber[i][2] * voxel_m[0]);
        f->axis_class[i] = 0;
    }
}

/* Every voxel is material, except in a slab at the bottom. */
static bool is_kept(size_t z) { return z >= 10; }

static void make_directions(struct direction_volume *d)
{
    assert_int_equal(direction_volume_init(d, n_voxel, voxel_m, NULL), STATUS_OK);
    for (size_t at = 0; at < (size_t)NX * NY * NZ; at++) {
        d->density[at] = is_kept(at / (NX * NY)) ? 200 : 0;
        direction_volume_set(d, at, before);
    }
}

/* Distance of a voxel's center from the axis of fiber i, in radii of the fiber. */
static double radii_away(size_t y, size_t z, size_t i)
{
    return hypot((double)y + 0.5 - fiber[i][0], (double)z + 0.5 - fiber[i][1]) / fiber[i][2];
}

/* Distance of a voxel's center from the surface of the fiber whose axis is nearer. */
static double surface_away(size_t y, size_t z)
{
    double away[2];
    for (size_t i = 0; i < 2; i++) away[i] = radii_away(y, z, i) * fiber[i][2];
    return away[0] < away[1] ? away[0] - fiber[0][2] : away[1] - fiber[1][2];
}

static void test_transfer(void **state)
{
    (void)state;
    struct fiber_set f;
    struct direction_volume d;
    struct reconstruct_report report = {0};
    size_t n_changed = 0, n_fiber = 0, n_both = 0, n_kept = 0;
    make_fibers(&f);
    make_directions(&d);
    assert_int_equal(reconstruct_transfer(&f, &d, NULL, NULL, &report, NULL), STATUS_OK);
    for (size_t at = 0; at < (size_t)NX * NY * NZ; at++) {
        size_t y = at / NX % NY, z = at / (NX * NY);
        double away = fmin(radii_away(y, z, 0), radii_away(y, z, 1));
        const double surface = surface_away(y, z);
        const int share = (int)fmax(1.0, rint(255.0 * fmin(1.0, 0.5 - surface)));
        bool changes = (is_kept(z) && away <= 2.0) || surface < 0.499;
        if (surface < 0.49) assert_true(abs((int)d.density[at] - share) <= 3);
        if (surface > 0.51) assert_int_equal(d.density[at], is_kept(z) ? 200 : 0);
        float got[3];
        direction_volume_get(&d, at, got);
        float cosine = changes ? got[0] : got[0] * before[0] + got[1] * before[1] + got[2] * before[2];
        if (fabsf(cosine) < 0.9999f) fail_msg("voxel y %zu, z %zu, %.3f radii from a fiber", y, z, away);
        n_changed += is_kept(z) && away <= 2.0;
        n_fiber += away <= 1.0;
        n_both += away <= 1.0 && is_kept(z);
        n_kept += is_kept(z);
    }
    assert_true(n_changed > 2 * n_both && n_both < n_fiber);
    assert_true(fabs(report.dice - 2.0 * (double)n_both / (double)(n_fiber + n_kept)) < 1e-12);
    assert_true(fabs(report.direction_change_mean_deg - 90.0) < 0.02);
    assert_true(fabs(report.axis_share[0] - (double)n_changed / (double)n_kept) < 1e-12);
    assert_true(fabs(report.axis_share[0] + report.axis_share[1] + report.axis_share[2] - 1.0) < 1e-12);
    fiber_set_release(&f);
    direction_volume_release(&d);
}

/* Without the step nothing changes, and the report states what it would have changed. */
static void test_kept_directions(void **state)
{
    (void)state;
    struct fiber_set f;
    struct direction_volume d, kept;
    struct reconstruct_report report = {0}, changed = {0};
    make_fibers(&f);
    make_directions(&d);
    make_directions(&kept);
    assert_int_equal(reconstruct_keep_directions(&f, &kept, NULL, NULL, &report, NULL), STATUS_OK);
    for (size_t at = 0; at < (size_t)NX * NY * NZ; at++) {
        float got[3], want[3];
        direction_volume_get(&kept, at, got);
        direction_volume_get(&d, at, want);
        assert_memory_equal(got, want, sizeof got);
        assert_int_equal(kept.density[at], d.density[at]);
    }
    assert_int_equal(reconstruct_transfer(&f, &d, NULL, NULL, &changed, NULL), STATUS_OK);
    assert_true(report.dice == changed.dice && report.direction_change_mean_deg == changed.direction_change_mean_deg);
    assert_true(report.direction_noise_deg[0] == changed.direction_noise_deg[0]);
    assert_true(report.direction_noise_deg[1] == report.direction_noise_deg[0]);
    assert_true(report.axis_share[0] < changed.axis_share[0]);
    fiber_set_release(&f);
    direction_volume_release(&d);
    direction_volume_release(&kept);
}

/* In a yarn along x of an unresolved scan one line crosses: its voxels take the yarn's direction, emptied ones stay
 * empty, and a yarn along y that is far away keeps its own direction. In a resolved scan nothing is averaged. */
static void test_unresolved(void **state)
{
    (void)state;
    enum { N = 70, MIDDLE = N / 2 };
    const size_t n[3] = {N, N, 20};
    const float x_axis[3] = {1.0f, 0.0f, 0.0f}, y_axis[3] = {0.0f, 1.0f, 0.0f};
    for (int unresolved = 0; unresolved < 2; unresolved++) {
        struct reconstruct_report report = {.grade.verdict = unresolved ? GRADE_UNRESOLVED : GRADE_PARTLY};
        struct fiber_set f;
        struct direction_volume d;
        make_fibers(&f);
        for (size_t i = 0; i < f.n_vertex; i++) f.position_m[3 * i + 2] = -1.0f; /* far from all voxels */
        assert_int_equal(direction_volume_init(&d, n, voxel_m, NULL), STATUS_OK);
        for (size_t at = 0; at < volume_n_voxel(n); at++) {
            const size_t x = at % N, y = at / N % N;
            d.density[at] = x % 10 == 5 ? 0 : 200; /* some voxels are emptied */
            direction_volume_set(&d, at, y >= MIDDLE || x / 3 == 10 ? y_axis : x_axis);
        }
        assert_int_equal(reconstruct_transfer(&f, &d, NULL, NULL, &report, NULL), STATUS_OK);
        for (size_t at = 0; at < volume_n_voxel(n); at++) {
            const size_t x = at % N, y = at / N % N;
            float got[3];
            assert_int_equal(d.density[at], x % 10 == 5 ? 0 : 200);
            if (d.density[at] == 0 || (y + 8 > MIDDLE && y < MIDDLE + 8)) continue;
            direction_volume_get(&d, at, got);
            const bool along_y = y >= MIDDLE || (!unresolved && x / 3 == 10);
            if (fabsf(got[along_y ? 1 : 0]) < 0.9999f) fail_msg("verdict %d, voxel x %zu, y %zu", unresolved, x, y);
        }
        fiber_set_release(&f);
        direction_volume_release(&d);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_transfer), cmocka_unit_test(test_kept_directions),
                                       cmocka_unit_test(test_unresolved)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
