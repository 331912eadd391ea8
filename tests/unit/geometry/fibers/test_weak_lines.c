/* Lines on noise, whose fit has found no edge, are dropped; thin fibers and light ones stay. */
#include "geometry/fibers/lines/weak_lines.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

enum { N = 20 };

/* Adds a line along x through slab k, which it fills with the density. */
static void add_line(struct polyline_set *p, struct volume *v, size_t k, float radius, float density)
{
    for (size_t i = 0; i < N * N; i++) v->density[k * N * N + i] = density;
    assert_int_equal(polyline_begin(p, 0, NULL), STATUS_OK);
    for (size_t i = 0; i <= N; i++) /* the last vertex is on the face */
        assert_int_equal(polyline_add(p, (const float[3]){(float)i, 10.0f, (float)k + 0.5f}, NULL), STATUS_OK);
    p->radius[p->n_line - 1] = radius;
}

static void test_weak_line_is_dropped(void **state)
{
    (void)state;
    const size_t n[3] = {N, N, N};
    const float radius[5] = {0.8f, 0.8f, 3.0f, 0.0f, 0.8f}, density[5] = {0.5f, 0.9f, 0.4f, 0.4f, 0.74f};
    struct volume v;
    struct polyline_set lines, kept;
    assert_int_equal(volume_init(&v, n, (const double[3]){1e-6, 1e-6, 1e-6}, NULL), STATUS_OK);
    polyline_set_init(&lines);
    polyline_set_init(&kept);
    for (size_t l = 0; l < 5; l++) add_line(&lines, &v, 3 * l + 2, radius[l], density[l]);
    assert_int_equal(polylines_drop_weak(&lines, &v, 0.82, 0.75, &kept, NULL), STATUS_OK);
    assert_int_equal(kept.n_line, 3);
    for (size_t l = 0; l < 3; l++) {
        assert_float_equal(kept.radius[l], radius[l + 1], 0.0);
        assert_int_equal(polyline_length(&kept, l), N + 1);
    }
    polyline_set_release(&lines);
    polyline_set_release(&kept);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_weak_line_is_dropped)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
