/* Fibers across the seams of a tile: those of a phantom continue exactly, and shifted ends are counted and joined. */
#include "geometry/fibers/seam/fiber_seam.h"
#include "geometry/phantom/phantom.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static void make(struct fiber_set *f)
{
    struct phantom_option o;
    struct phantom_report report;
    phantom_option_default(&o, PHANTOM_PLAIN);
    fiber_set_init(f);
    assert_int_equal(phantom_generate(&o, NULL, NULL, f, &report, NULL), STATUS_OK);
}

static void test_phantom(void **state)
{
    (void)state;
    struct fiber_set f;
    struct fiber_seam s;
    make(&f);
    assert_int_equal(fiber_seam_measure(&f, &s, NULL), STATUS_OK);
    for (int a = 0; a < 2; a++) {
        print_message("%c: %zu ends, %.3f continue, offset %.3f um\n", "xy"[a], s.n_end[a], s.share[a],
                      s.offset_m[a] * 1e6);
        assert_true(s.n_end[a] > 20);
        assert_true(s.share[a] > 0.97);
        assert_true(s.offset_m[a] < 0.01 * (double)f.radius_m[0]);
    }
    fiber_set_release(&f);
}

/* Shifts the upper half of x in z, by 0 in the middle of the tile and by `by` at the seam across x. */
static void shift_half(struct fiber_set *f, float by)
{
    float middle = 0.5f * (float)f->tile_size_m[0];
    for (size_t i = 0; i < f->n_vertex; i++)
        if (f->position_m[3 * i] > middle) f->position_m[3 * i + 2] += by * (f->position_m[3 * i] - middle) / middle;
}

static void test_shifted(void **state)
{
    (void)state;
    struct fiber_set f;
    struct fiber_seam before, after;
    struct seam_join join;
    make(&f);
    float by = 0.6f * f.radius_m[0];
    shift_half(&f, by);
    double length = fiber_set_length_m(&f);
    assert_int_equal(fiber_seam_measure(&f, &before, NULL), STATUS_OK);
    assert_true(before.share[0] > 0.9); /* a few nearer neighbours */
    assert_true(fabs(before.offset_m[0] - (double)by) < 0.15 * (double)by);
    assert_int_equal(fiber_seam_join(&f, &join, NULL), STATUS_OK);
    assert_int_equal(fiber_seam_measure(&f, &after, NULL), STATUS_OK);
    print_message("%zu pairs joined: x %.3f -> %.3f continue, offset %.3f -> %.6f um\n", join.n_joined, before.share[0],
                  after.share[0], before.offset_m[0] * 1e6, after.offset_m[0] * 1e6);
    assert_true(join.n_joined >= (size_t)(0.45 * (double)(before.n_end[0] + before.n_end[1])));
    assert_true(after.share[0] >= before.share[0] && after.offset_m[0] < 1e-9);
    assert_true(after.share[1] > 0.97 && after.offset_m[1] < 1e-9);
    assert_int_equal(fiber_set_validate(&f, NULL), STATUS_OK);
    assert_true(fabs(fiber_set_length_m(&f) / length - 1.0) < 0.01);
    shift_half(&f, 40.0f * by); /* farther than the reach, so that no end continues */
    assert_int_equal(fiber_seam_measure(&f, &after, NULL), STATUS_OK);
    assert_true(after.share[0] < 0.4);
    fiber_set_release(&f);
}

/* Moves all yarns at the face x = tile by `along` in y, and less and less towards x = 0, and shortens the tile
 * there. */
static void skew(struct fiber_set *f, float along)
{
    const float tile = (float)f->tile_size_m[0];
    for (size_t i = 0; i < f->n_vertex; i++) f->position_m[3 * i + 1] += along * f->position_m[3 * i] / tile;
}

/* Yarns that meet five radii beside each other, farther than their fibers are apart, are brought together by the warp,
 * so that fibers find their own continuations; single ends are off by half a radius in addition. */
static void test_skewed(void **state)
{
    (void)state;
    struct fiber_set f;
    struct fiber_seam before, after;
    struct seam_join join;
    make(&f);
    const double radius = (double)f.radius_m[0], length = fiber_set_length_m(&f);
    skew(&f, 5.0f * f.radius_m[0]);
    assert_int_equal(fiber_seam_measure(&f, &before, NULL), STATUS_OK);
    assert_int_equal(fiber_seam_join(&f, &join, NULL), STATUS_OK);
    assert_int_equal(fiber_seam_measure(&f, &after, NULL), STATUS_OK);
    for (int a = 0; a < 2; a++)
        print_message(
            "%c: warp %.2f radii, shift %.3f; continue %.3f -> %.3f, offset %.3f -> %.3f radii, angle %.2f -> "
            "%.2f degrees, step %.2f -> %.2f (%.2f)\n",
            "xy"[a], join.warp_m[a] / radius, join.shift_m[a] / radius, before.share[a], after.share[a],
            before.offset_m[a] / radius, after.offset_m[a] / radius, before.angle_rad[a] * 180.0 / M_PI,
            after.angle_rad[a] * 180.0 / M_PI, before.step[a], after.step[a], after.step_inside[a]);
    assert_true(fabs(join.warp_m[0] / radius - 2.5) < 0.2);
    assert_true(join.warp_m[1] < 0.25 * radius); /* the seam across y has no offset of its own */
    assert_true(before.share[0] < 0.7 && after.share[0] > 0.95 && after.share[1] > 0.95);
    assert_true(after.offset_m[0] < 0.01 * radius);
    assert_true(after.angle_rad[0] < 0.6 * before.angle_rad[0] && after.angle_rad[0] * 180.0 / M_PI < 4.0);
    assert_true(after.step[0] < 0.8 * before.step[0] && after.step[0] < after.step_inside[0]);
    assert_int_equal(fiber_set_validate(&f, NULL), STATUS_OK);
    assert_true(fabs(fiber_set_length_m(&f) / length - 1.0) < 0.02);
    fiber_set_release(&f);
}

/* Ends in random places have no common offset, so nothing is warped. */
static void test_unrelated(void **state)
{
    (void)state;
    struct fiber_set f;
    struct fiber_seam before, after;
    struct seam_join join;
    enum { N = 400 };
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 2 * N, 6 * N, NULL), STATUS_OK);
    f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
    srand(3);
    for (size_t i = 0; i < 2 * N; i++) {
        const float y = 1e-6f * (float)(rand() % 1000), z = 1e-6f * (float)(rand() % 500);
        f.first_vertex[i + 1] = 3 * i + 3;
        f.radius_m[i] = 5e-6f;
        for (size_t k = 0; k < 3; k++) {
            float *p = f.position_m + 3 * (3 * i + k);
            p[0] = (i < N ? 0.0f : 0.6e-3f) + 0.2e-3f * (float)k;
            p[1] = y;
            p[2] = z;
        }
    }
    assert_int_equal(fiber_seam_measure(&f, &before, NULL), STATUS_OK);
    assert_int_equal(fiber_seam_join(&f, &join, NULL), STATUS_OK);
    assert_int_equal(fiber_seam_measure(&f, &after, NULL), STATUS_OK);
    print_message("unrelated: warp %.3f um, continue %.3f -> %.3f\n", join.warp_m[0] * 1e6, before.share[0],
                  after.share[0]);
    assert_true(join.warp_m[0] < 0.1 * 5e-6);
    assert_true(before.share[0] < 0.2 && after.share[0] > 0.6);
    fiber_set_release(&f);
}

static void test_no_ends(void **state)
{
    (void)state;
    struct fiber_set f;
    struct fiber_seam s;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, 2, NULL), STATUS_OK);
    f.first_vertex[1] = 2;
    f.tile_size_m[0] = f.tile_size_m[1] = 1.0;
    f.radius_m[0] = 0.01f;
    for (int i = 0; i < 6; i++) f.position_m[i] = i < 3 ? 0.4f : 0.6f;
    assert_int_equal(fiber_seam_measure(&f, &s, NULL), STATUS_OK);
    assert_true(s.n_end[0] == 0 && isnan(s.share[0]) && isnan(s.offset_m[1]));
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_phantom), cmocka_unit_test(test_shifted),
                                       cmocka_unit_test(test_skewed), cmocka_unit_test(test_unrelated),
                                       cmocka_unit_test(test_no_ends)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
