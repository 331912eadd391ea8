/* Which of two lines that pass through each other is removed: known answers. */
#include "geometry/fibers/lines/joining.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* Adds a line of radius 3 with one vertex a voxel along an axis. */
static void add_line(struct polyline_set *p, uint8_t axis, size_t n_vertex, float x, float y, float z)
{
    assert_int_equal(polyline_begin(p, axis, NULL), STATUS_OK);
    p->radius[p->n_line - 1] = 3.0f;
    for (size_t i = 0; i < n_vertex; i++) {
        float at[3] = {x, y, z};
        at[axis] += (float)i;
        assert_int_equal(polyline_add(p, at, NULL), STATUS_OK);
    }
}

/* Lines beside each other at 0.75 of the sum of their radii: fibers do not pass through each other, so the shorter one
 * goes where radii are known. A line that crosses at that distance stays. */
static void test_touching_fibers(void **state)
{
    (void)state;
    const size_t n[3] = {64, 64, 32};
    for (int known = 0; known < 2; known++) {
        struct polyline_set in, out;
        struct join_counts counts = {0};
        polyline_set_init(&in);
        polyline_set_init(&out);
        add_line(&in, 0, 59, 2.5f, 20.0f, 16.0f);
        add_line(&in, 0, 31, 10.5f, 24.5f, 16.0f);
        add_line(&in, 1, 60, 50.0f, 2.5f, 20.5f);
        assert_int_equal(polylines_remove_duplicates(
                             &in, &(struct duplicate_option){{n[0], n[1], n[2]}, 6.0, known == 1 ? 0.85 : 0.0, NULL}, 4,
                             &out, &counts, NULL),
                         STATUS_OK);
        assert_int_equal(out.n_line, known == 1 ? 2 : 3);
        assert_int_equal(out.n_vertex, known == 1 ? 59 + 60 : 59 + 31 + 60);
        polyline_set_release(&in);
        polyline_set_release(&out);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_touching_fibers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
