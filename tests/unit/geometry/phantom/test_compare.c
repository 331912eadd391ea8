/* The comparison of fiber sets on cases with known answers. */
#include "base/angle.h"
#include "geometry/phantom/compare.h"
#include "geometry/phantom/segment_grid.h"

#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { N_FIBER = 9, N_VERTEX = 101 };
static const double voxel = 2e-6;

struct piece {
    size_t from, to;            /* vertices */
    double y, y_end, z, radius; /* voxels */
};

/* Straight pieces along x; vertex k at x = k voxels. Tile 100 x 100 voxels. */
static struct fiber_set build(const struct piece *piece, size_t n)
{
    struct fiber_set f;
    size_t n_vertex = 0, at = 0;
    fiber_set_init(&f);
    for (size_t i = 0; i < n; i++) n_vertex += piece[i].to - piece[i].from + 1;
    assert_int_equal(fiber_set_reserve(&f, n, n_vertex, NULL), STATUS_OK);
    f.tile_size_m[0] = f.tile_size_m[1] = 100 * voxel;
    for (size_t i = 0; i < n; i++) {
        for (size_t k = piece[i].from; k <= piece[i].to; k++, at++) {
            double w = (double)(k - piece[i].from) / (double)(piece[i].to - piece[i].from);
            f.position_m[3 * at] = (float)((double)k * voxel);
            f.position_m[3 * at + 1] = (float)((piece[i].y + w * (piece[i].y_end - piece[i].y)) * voxel);
            f.position_m[3 * at + 2] = (float)(piece[i].z * voxel);
        }
        f.radius_m[i] = (float)(piece[i].radius * voxel);
        f.first_vertex[i + 1] = at;
    }
    fiber_set_classify(&f);
    return f;
}

/* Nine fibers 10 voxels apart, radius 3.4 voxels. */
static void nine(struct piece piece[N_FIBER])
{
    for (size_t i = 0; i < N_FIBER; i++) {
        double y = 10.0 + 10.0 * (double)i;
        piece[i] = (struct piece){0, 100, y, y, 20.0, 3.4};
    }
}

static struct compare_report compare(const struct piece *found, size_t n)
{
    struct piece truth[N_FIBER];
    struct compare_report r;
    struct error err = {0};
    const struct compare_option o = {.voxel_size_m = voxel};
    nine(truth);
    struct fiber_set t = build(truth, N_FIBER), f = build(found, n);
    if (compare_fibers(&t, &f, &o, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&t);
    fiber_set_release(&f);
    return r;
}

#define check_near(value, want, tolerance)                                                                             \
    do {                                                                                                               \
        if (!(fabs((value) - (want)) <= (tolerance)))                                                                  \
            fail_msg(#value " is %g, not %g", (double)(value), (double)(want));                                        \
    } while (0)

static void test_identical(void **state)
{
    (void)state;
    struct piece p[N_FIBER];
    nine(p);
    struct compare_report r = compare(p, N_FIBER);
    assert_int_equal(r.n_true, 9);
    assert_int_equal(r.n_found, 9);
    check_near(r.fiber_diameter_voxel, 6.8, 1e-5);
    check_near(r.length_true_m, 900 * voxel, 1e-9);
    check_near(r.center_recall, 1.0, 0);
    check_near(r.center_precision, 1.0, 0);
    check_near(r.centerline_rms_voxel, 0.0, 1e-6);
    check_near(r.centerline_p95_voxel, 0.0, 1e-6);
    check_near(r.length_recovered, 1.0, 0);
    check_near(r.longest_run, 1.0, 0);
    check_near(r.missed, 0.0, 0);
    check_near(r.fragments_per_fiber, 1.0, 0);
    check_near(r.gaps_per_fiber, 0.0, 0);
    check_near(r.merges_per_fiber, 0.0, 0);
    check_near(r.direction_mean_deg, 0.0, 1e-6);
    check_near(r.orientation_frobenius, 0.0, 1e-9);
    check_near(r.radius_bias_percent, 0.0, 1e-6);
    check_near(r.radius_rms_percent, 0.0, 1e-6);
}

static void test_shifted_and_thicker(void **state)
{
    (void)state;
    struct piece p[N_FIBER];
    nine(p);
    for (size_t i = 0; i < N_FIBER; i++) {
        p[i].z += 0.2;
        p[i].radius *= 1.1;
    }
    struct compare_report r = compare(p, N_FIBER);
    check_near(r.centerline_rms_voxel, 0.2, 1e-4);
    check_near(r.centerline_p95_voxel, 0.2, 1e-4);
    check_near(r.center_recall, 1.0, 0);
    check_near(r.radius_bias_percent, 10.0, 1e-4);
    check_near(r.radius_rms_percent, 10.0, 1e-4);
    for (size_t i = 0; i < N_FIBER; i++) p[i].z += 4.0; /* farther than one radius, so nothing matches */
    r = compare(p, N_FIBER);
    check_near(r.center_recall, 0.0, 0);
    check_near(r.center_precision, 0.0, 0);
    check_near(r.missed, 1.0, 0);
    assert_true(isnan(r.centerline_rms_voxel) && isnan(r.fragments_per_fiber) && isnan(r.direction_mean_deg));
}

static void test_shift_by_a_tile_is_no_shift(void **state)
{
    (void)state;
    struct piece p[N_FIBER];
    nine(p);
    for (size_t i = 0; i < N_FIBER; i++) {
        p[i].y -= i % 2 == 0 ? 100.0 : -200.0;
        p[i].y_end = p[i].y;
    }
    struct compare_report r = compare(p, N_FIBER);
    check_near(r.center_recall, 1.0, 0);
    check_near(r.centerline_rms_voxel, 0.0, 1e-4);
    check_near(r.fragments_per_fiber, 1.0, 0);
}

static void test_cut_and_missing(void **state)
{
    (void)state;
    struct piece p[N_FIBER + 2];
    nine(p);
    p[9] = p[10] = p[4]; /* fiber 4 in three pieces; each gap of 10 voxels is closed by 3.4 voxels at both sides */
    p[4].to = 30;
    p[9].from = 40;
    p[9].to = 60;
    p[10].from = 70;
    struct compare_report r = compare(p, N_FIBER + 2);
    check_near(r.fragments_per_fiber, 11.0 / 9.0, 1e-12);
    check_near(r.gaps_per_fiber, 2.0 / 9.0, 1e-12);
    check_near(r.center_recall, (900.0 - 2 * 4) / 900.0,
               1e-12); /* samples at 33.5 .. 36.5 and their like are out of reach */
    check_near(r.longest_run, (8.0 + 0.33) / 9.0, 0.005);
    check_near(r.center_precision, 1.0, 0);
    nine(p);
    r = compare(p + 1, N_FIBER - 1);
    check_near(r.center_recall, 8.0 / 9.0, 1e-12);
    check_near(r.missed, 1.0 / 9.0, 1e-12);
    check_near(r.fragments_per_fiber, 1.0, 0);
}

static void test_merged(void **state)
{
    (void)state;
    struct piece p[N_FIBER];
    nine(p);
    p[3].y_end = p[4].y; /* crosses over from fiber 3 to fiber 4, which has no fiber of its own */
    for (size_t i = 4; i + 1 < N_FIBER; i++) p[i] = p[i + 1];
    struct compare_report r = compare(p, N_FIBER - 1);
    check_near(r.merges_per_fiber, 1.0 / 9.0, 1e-12);
    check_near(r.fragments_per_fiber, 1.0, 1e-12); /* nine pairs on nine fibers */
    check_near(r.missed, 0.0, 0);
    check_near(r.center_recall, (7.0 + 2 * 0.37) / 9.0, 1e-9); /* within 3.4 of 10 voxels; and across the face */
    double slope_deg = angle_to_deg(atan(0.1));
    check_near(r.direction_mean_deg, slope_deg * 0.68 / 7.68, 0.02);
    check_near(r.direction_p95_deg, slope_deg, 0.01);
}

/* A fiber that leaves through a face and enters through the opposite one is two fibers in a scan. A fiber that only
 * touches the face is one. */
static void test_faces_cut_fibers(void **state)
{
    (void)state;
    struct piece truth[2] = {{0, 100, 90.0, 110.0, 20.0, 3.4}, {0, 100, 50.0, 50.0, 20.0, 3.4}};
    struct piece found[3] = {{0, 50, 90.0, 100.0, 20.0, 3.4}, {50, 100, 0.0, 10.0, 20.0, 3.4}, truth[1]};
    const struct compare_option o = {.voxel_size_m = voxel};
    struct compare_report r;
    struct fiber_set t = build(truth, 2), f = build(found, 3);
    assert_int_equal(compare_fibers(&t, &f, &o, &r, NULL), STATUS_OK);
    assert_int_equal(r.n_true, 2);
    assert_int_equal(r.n_true_piece, 3);
    check_near(r.center_recall, 1.0, 0);
    check_near(r.fragments_per_fiber, 1.0, 0);
    check_near(r.merges_per_fiber, 0.0, 0);
    check_near(r.missed, 0.0, 0);
    fiber_set_release(&t);
    truth[0].y = 99.0; /* within a radius of the face all the way */
    truth[0].y_end = 101.0;
    t = build(truth, 2);
    assert_int_equal(compare_fibers(&t, &f, &o, &r, NULL), STATUS_OK);
    assert_int_equal(r.n_true_piece, 2);
    fiber_set_release(&t);
    fiber_set_release(&f);
}

static void test_double_hits_cost_precision(void **state)
{
    (void)state;
    struct piece p[N_FIBER + 2];
    nine(p);
    p[9] = p[2];
    p[9].z += 1.0; /* a second fiber in fiber 2, and one in the void */
    p[10] = p[2];
    p[10].z += 20.0;
    struct compare_report r = compare(p, N_FIBER + 2);
    check_near(r.center_precision, 9.0 / 11.0, 1e-9);
    check_near(r.center_recall, 1.0, 0);
    check_near(r.fragments_per_fiber, 10.0 / 9.0, 1e-12);
}

static void test_orientation_tensor(void **state)
{
    (void)state;
    struct piece truth[N_FIBER];
    const struct compare_option o = {.voxel_size_m = voxel};
    struct compare_report r;
    nine(truth);
    struct fiber_set t = build(truth, N_FIBER), f = build(truth, N_FIBER);
    for (size_t k = 0; k < f.n_vertex; k++) { /* the same fibers along y instead: diag(1,0,0) - diag(0,1,0) */
        float x = f.position_m[3 * k];
        f.position_m[3 * k] = f.position_m[3 * k + 1];
        f.position_m[3 * k + 1] = x;
    }
    assert_int_equal(compare_fibers(&t, &f, &o, &r, NULL), STATUS_OK);
    check_near(r.orientation_frobenius, sqrt(2.0), 1e-6);
    check_near(r.length_recovered, 0.0, 0); /* crossed, not followed */
    assert_true(r.center_recall > 0.5);
    fiber_set_release(&f);
    f = build(truth, N_FIBER);
    for (size_t k = 0; k < f.n_vertex; k++) /* in reverse order: the sign of a direction has no meaning */
        f.position_m[3 * k] = (float)(100 * voxel) - f.position_m[3 * k];
    assert_int_equal(compare_fibers(&t, &f, &o, &r, NULL), STATUS_OK);
    check_near(r.orientation_frobenius, 0.0, 1e-9);
    check_near(r.direction_mean_deg, 0.0, 0.05);
    check_near(r.length_recovered, 1.0, 0);
    fiber_set_release(&f);
    fiber_set_release(&t);
}

static void test_margin_and_errors(void **state)
{
    (void)state;
    struct piece p[N_FIBER];
    nine(p);
    p[0].from = 8; /* what lies within 10 voxels of the faces does not count */
    struct fiber_set f = build(p, N_FIBER);
    p[0].from = 0;
    struct fiber_set t = build(p, N_FIBER), empty;
    struct compare_option o = {.voxel_size_m = voxel, .margin_m = 9 * voxel};
    struct compare_report r;
    struct error err;
    fiber_set_init(&empty);
    assert_int_equal(compare_fibers(&t, &f, &o, &r, NULL), STATUS_OK);
    check_near(r.center_recall, 1.0, 0);
    check_near(r.missed, 0.0, 0);
    assert_int_equal(compare_fibers(&t, &empty, &o, &r, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "found fibers"));
    assert_int_equal(compare_fibers(&t, &empty, &o, &r, NULL), STATUS_INVALID); /* the same without an error record */
    assert_int_equal(compare_fibers(&empty, &f, &o, &r, &err), STATUS_INVALID);
    o.voxel_size_m = 0.0;
    assert_int_equal(compare_fibers(&t, &f, &o, &r, &err), STATUS_INVALID);
    fiber_set_release(&t);
    fiber_set_release(&f);
}

/* The search by the grid against a search over all segments. */
static void test_nearest_segment_by_brute_force(void **state)
{
    (void)state;
    enum { N = 40, STEPS = 6 };
    struct fiber_set f;
    const struct rng_key key = {.seed = 9};
    const double tile[2] = {1.0, 0.6};
    struct rng rng;
    struct segment_grid *grid;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, N, N * STEPS, NULL), STATUS_OK);
    rng_start(&rng, &key, 0, 0);
    for (size_t i = 0; i < N; i++) {
        f.radius_m[i] = 0.01f;
        f.first_vertex[i + 1] = (i + 1) * STEPS;
        for (size_t k = 0; k < STEPS; k++)
            for (size_t a = 0; a < 3; a++) {
                float *p = f.position_m + 3 * (i * STEPS + k) + a;
                *p = k == 0 ? 2.0f * rng_float(&rng) - 0.5f : p[-3] + 0.2f * (rng_float(&rng) - 0.5f);
            }
    }
    assert_int_equal(segment_grid_new(&f, tile, 0.15, &grid, NULL), STATUS_OK);
    for (int q = 0; q < 2000; q++) {
        double p[3], best = 0.15;
        struct segment_hit hit;
        for (int a = 0; a < 3; a++) p[a] = 3.0 * rng_double(&rng) - 1.0;
        for (size_t i = 0; i < N; i++)
            for (size_t v = f.first_vertex[i]; v + 1 < f.first_vertex[i + 1]; v++)
                for (int wx = -4; wx <= 4; wx++)
                    for (int wy = -6; wy <= 6; wy++) {
                        double d[3], c[3], dd = 0, dc = 0, d2 = 0;
                        for (size_t a = 0; a < 3; a++) {
                            d[a] = (double)f.position_m[3 * v + 3 + a] - (double)f.position_m[3 * v + a];
                            c[a] = p[a] - (double)f.position_m[3 * v + a] +
                                   (a == 0   ? wx * tile[0]
                                    : a == 1 ? wy * tile[1]
                                             : 0.0);
                            dd += d[a] * d[a];
                            dc += d[a] * c[a];
                        }
                        double t = fmin(1.0, fmax(0.0, dc / dd));
                        for (int a = 0; a < 3; a++) d2 += pow(c[a] - t * d[a], 2);
                        best = fmin(best, sqrt(d2));
                    }
        bool any = segment_grid_nearest(grid, p, 0.15, &hit);
        assert_int_equal(any, best < 0.15);
        if (any) check_near(hit.distance_m, best, 1e-12);
    }
    segment_grid_free(grid);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_identical),
        cmocka_unit_test(test_shifted_and_thicker),
        cmocka_unit_test(test_shift_by_a_tile_is_no_shift),
        cmocka_unit_test(test_cut_and_missing),
        cmocka_unit_test(test_merged),
        cmocka_unit_test(test_faces_cut_fibers),
        cmocka_unit_test(test_double_hits_cost_precision),
        cmocka_unit_test(test_orientation_tensor),
        cmocka_unit_test(test_margin_and_errors),
        cmocka_unit_test(test_nearest_segment_by_brute_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
