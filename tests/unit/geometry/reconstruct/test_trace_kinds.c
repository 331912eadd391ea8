/* The kinds of traced lines: known radii. */
#include "geometry/reconstruct/trace_kinds.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* Lines of ten voxels, the radius of line i of which is radius[i]. */
static void make_lines(const float *radius, size_t n, struct polyline_set *lines)
{
    polyline_set_init(lines);
    for (size_t l = 0; l < n; l++) {
        assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
        lines->radius[l] = radius[l];
        for (int i = 0; i < 10; i++) {
            const float x[3] = {(float)i, (float)l, 0.0f};
            assert_int_equal(polyline_add(lines, x, NULL), STATUS_OK);
        }
    }
}

static struct trace_kinds kinds_of(const float *radius, size_t n, double spread)
{
    struct polyline_set lines;
    struct trace_kinds kinds;
    make_lines(radius, n, &lines);
    assert_int_equal(trace_find_kinds(&lines, spread, &kinds, NULL), STATUS_OK);
    polyline_set_release(&lines);
    return kinds;
}

/* Radii of two kinds spread little within each, and the mean of the thin ones is known. */
static void test_two_kinds(void **state)
{
    (void)state;
    const float radius[8] = {2.0f, 6.0f, 2.2f, 6.3f, 1.8f, 5.7f, 2.0f, 6.0f};
    const struct trace_kinds kinds = kinds_of(radius, 8, 0.52);
    assert_true(fabs(kinds.thin_diameter - 4.0) < 1e-6);
    assert_true(fabs(kinds.spread - sqrt(0.02) / 2.0) < 1e-6); /* of the thin ones */
}

/* Where radii are even from thin to thick, or alike, the spread of all stays. */
static void test_one_kind(void **state)
{
    (void)state;
    const float even[8] = {2.0f, 2.5f, 3.0f, 3.5f, 4.0f, 4.5f, 5.0f, 5.5f}, alike[2] = {3.5f, 3.5f};
    struct trace_kinds kinds = kinds_of(even, 8, 0.3);
    assert_true(kinds.spread == 0.3 && kinds.thin_diameter == 0.0);
    kinds = kinds_of(alike, 2, 0.01);
    assert_true(kinds.spread == 0.01 && kinds.thin_diameter == 0.0);
    kinds = kinds_of(alike, 0, 0.0);
    assert_true(kinds.spread == 0.0 && kinds.thin_diameter == 0.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_kinds),
        cmocka_unit_test(test_one_kind),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
