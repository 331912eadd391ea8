/* Lines that change to the neighbouring fiber are cut at that place, and lines that bend like fibers are not cut.
 * Ends that do not follow the measured directions are trimmed. */
#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/lines/disagreement.h"
#include "geometry/fibers/lines/kinks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N_VERTEX = 100, N_LINE = 12 };
static const double DIAMETER = 7.0;

/* Crimped lines side by side, with a radius of curvature of 2 diameters at the crests. Line `hopper` changes to its
 * neighbour, one diameter away, at vertex 50. */
static void make_lines(struct polyline_set *even, size_t hopper)
{
    struct polyline_set drawn, *lines = &drawn;
    polyline_set_init(lines);
    for (size_t l = 0; l < N_LINE; l++) {
        double wave = 2.0 * M_PI / 80.0, height = 1.0 / (2.0 * DIAMETER * wave * wave);
        assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
        for (size_t i = 0; i < N_VERTEX; i++) {
            double side = l == hopper ? 0.5 * DIAMETER * (1.0 + tanh(((double)i - 50.0) / 1.5)) : 0.0;
            const float x[3] = {(float)i, (float)(20.0 + DIAMETER * (double)l + side),
                                (float)(30.0 + height * sin(wave * (double)i))};
            assert_int_equal(polyline_add(lines, x, NULL), STATUS_OK);
        }
    }
    polyline_set_init(even);
    assert_int_equal(polylines_resample(lines, even, NULL), STATUS_OK);
    polyline_set_release(lines);
}

static void test_kink_is_cut(void **state)
{
    (void)state;
    struct polyline_set lines, out;
    size_t n_cut;
    make_lines(&lines, 4);
    polyline_set_init(&out);
    assert_int_equal(polylines_cut_kinks(&lines, DIAMETER, 2.1, 10, false, &out, &n_cut, NULL), STATUS_OK);
    assert_int_equal(out.n_line, N_LINE + 1);
    assert_true(n_cut >= 5 && n_cut <= 25);
    assert_int_equal(out.n_vertex + n_cut, lines.n_vertex);
    float last = out.vertex[out.first[5] - 1][0], next = out.vertex[out.first[5]][0]; /* the two pieces of line 4 */
    assert_true(last < 50.0f && last > 35.0f && next > 50.0f && next < 65.0f);
    polyline_set_release(&lines);
    polyline_set_release(&out);
}

/* A corner in the middle of a line: what is cut off lies evenly on both sides of it. */
static void test_cut_is_even(void **state)
{
    (void)state;
    struct polyline_set lines, out;
    size_t n_cut;
    polyline_set_init(&lines);
    polyline_set_init(&out);
    assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
    for (int i = -50; i <= 50; i++) {
        const float x[3] = {i < 0 ? (float)i : 0.0f, i > 0 ? (float)i : 0.0f, 0.0f};
        assert_int_equal(polyline_add(&lines, x, NULL), STATUS_OK);
    }
    assert_int_equal(polylines_cut_kinks(&lines, DIAMETER, 2.1, 10, false, &out, &n_cut, NULL), STATUS_OK);
    assert_int_equal(out.n_line, 2);
    assert_int_equal(polyline_length(&out, 0), polyline_length(&out, 1));
    assert_int_equal(n_cut % 2, 1);
    polyline_set_release(&out);
    polyline_set_init(&out); /* the sharpest vertex alone is the corner */
    assert_int_equal(polylines_cut_kinks(&lines, DIAMETER, 2.1, 10, true, &out, &n_cut, NULL), STATUS_OK);
    assert_int_equal(out.n_line, 2);
    assert_int_equal(n_cut, 1);
    assert_true(polyline_length(&out, 0) == 50 && polyline_length(&out, 1) == 50);
    polyline_set_release(&lines);
    polyline_set_release(&out);
}

static void test_crimp_is_kept(void **state)
{
    (void)state;
    struct polyline_set lines, out;
    size_t n_cut;
    double limit;
    make_lines(&lines, N_LINE);
    polyline_set_init(&out);
    assert_int_equal(polylines_kink_limit(&lines, DIAMETER, 2.1, &limit, NULL), STATUS_OK);
    assert_true(limit * DIAMETER >= 1.2 - 1e-12);
    assert_int_equal(polylines_cut_kinks(&lines, DIAMETER, 2.1, 10, false, &out, &n_cut, NULL), STATUS_OK);
    assert_int_equal(out.n_line, N_LINE);
    assert_int_equal(n_cut, 0);
    polyline_set_release(&lines);
    polyline_set_release(&out);
}

/* Fibers along x; a line whose first ten vertices run at 45 degrees to them. They are cut where they lie in the fiber
 * of another line; alone they stay, because the direction volume may be wrong. */
static void test_stray_end_is_cut(void **state)
{
    (void)state;
    const size_t n[3] = {64, 32, 16};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    const float along[3] = {1.0f, 0.0f, 0.0f};
    struct direction_volume d;
    struct polyline_set lines, out;
    size_t n_cut;
    assert_int_equal(direction_volume_init_in(&d, n, voxel_m, NULL, NULL), STATUS_OK);
    for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
        d.density[i] = 255;
        direction_volume_set(&d, i, along);
    }
    polyline_set_init(&lines);
    polyline_set_init(&out);
    assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
    for (int i = 0; i < 50; i++) {
        const float x[3] = {(float)i + 5.5f, i < 10 ? 22.0f - (float)i : 12.0f, 8.5f};
        assert_int_equal(polyline_add(&lines, x, NULL), STATUS_OK);
    }
    lines.radius[0] = 3.0f;
    assert_int_equal(polylines_cut_disagreeing(&lines, &d, &(struct disagreement_option){M_PI / 6.0, 0, 10, NULL}, &out,
                                               &n_cut, NULL),
                     STATUS_OK);
    assert_true(n_cut == 0 && out.n_line == 1 && out.n_vertex == 50);
    polyline_set_release(&out);
    polyline_set_init(&out);
    assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
    for (int i = 0; i < 25; i++)
        assert_int_equal(polyline_add(&lines, (const float[3]){(float)i + 0.5f, 17.0f, 8.5f}, NULL), STATUS_OK);
    lines.radius[1] = 3.0f;
    assert_int_equal(polylines_cut_disagreeing(&lines, &d, &(struct disagreement_option){M_PI / 6.0, 0, 10, NULL}, &out,
                                               &n_cut, NULL),
                     STATUS_OK);
    assert_int_equal(out.n_line, 2);
    assert_true(n_cut >= 8 && n_cut <= 12 && polyline_length(&out, 0) == 50 - n_cut && polyline_length(&out, 1) == 25);
    polyline_set_release(&out);
    polyline_set_init(&out);
    assert_int_equal(polylines_cut_disagreeing(&lines, &d, &(struct disagreement_option){M_PI / 6.0, 0, 43, NULL}, &out,
                                               &n_cut, NULL),
                     STATUS_OK);
    assert_int_equal(out.n_line, 0);
    polyline_set_release(&lines);
    polyline_set_release(&out);
    direction_volume_release(&d);
}

/* Two straight fibers of radius 3 along x that touch. A third line leaves its own fiber, where nothing else is, at 45
 * degrees and ends in the second fiber, and a fourth runs across through void. Only the end of the third is trimmed. */
static void test_end_in_another_fiber_is_trimmed(void **state)
{
    (void)state;
    const size_t n[3] = {100, 60, 20};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    const float along[3] = {1.0f, 0.0f, 0.0f}, y[3] = {10.0f, 16.0f, 24.0f};
    const int n_vertex[4] = {90, 90, 50, 20};
    struct direction_volume d;
    struct polyline_set lines, out;
    assert_int_equal(direction_volume_init_in(&d, n, voxel_m, NULL, NULL), STATUS_OK);
    for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
        d.density[i] = 255;
        direction_volume_set(&d, i, along);
    }
    polyline_set_init(&lines);
    polyline_set_init(&out);
    for (int l = 0; l < 4; l++) {
        assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
        for (int i = 0; i < n_vertex[l]; i++) {
            const float turned = l == 2 && i >= 40 ? (float)(i - 40) : 0.0f;
            const float x[3] = {l == 3 ? 60.5f : 0.5f + (float)i, l == 3 ? 35.0f + (float)i : y[l] - turned, 8.5f};
            assert_int_equal(polyline_add(&lines, x, NULL), STATUS_OK);
        }
        lines.radius[l] = 3.0f;
    }
    assert_int_equal(
        polylines_trim_disagreeing(&lines, &d, &(struct disagreement_option){M_PI / 6.0, 12, 10, NULL}, &out, NULL),
        STATUS_OK);
    assert_int_equal(out.n_line, 4);
    assert_true(polyline_length(&out, 2) >= 40 && polyline_length(&out, 2) <= 44);
    for (size_t l = 0; l < 4; l++) assert_true(l == 2 || polyline_length(&out, l) == (size_t)n_vertex[l]);
    polyline_set_release(&lines);
    polyline_set_release(&out);
    direction_volume_release(&d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kink_is_cut),
        cmocka_unit_test(test_cut_is_even),
        cmocka_unit_test(test_crimp_is_kept),
        cmocka_unit_test(test_stray_end_is_cut),
        cmocka_unit_test(test_end_in_another_fiber_is_trimmed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
