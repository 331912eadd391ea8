/* Rolls and folds: cloth keeps its lengths, its sides are where the header says, and turns do not touch. */
#include "renderer/mesh/mesh_curves.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static void check_strip(const struct mesh *m)
{
    struct error err;
    assert_int_equal(mesh_check(m, &err), STATUS_OK);
    const struct mesh_stretch stretch = mesh_stretch(m);
    assert_true(fabs(stretch.area - (1.0)) <= 1e-9);
    for (int a = 0; a < 2; a++) assert_true(fabs(stretch.along[a] - (1.0)) <= 1e-9);
}

static void a_roll_has_its_upper_side_outside(void **state)
{
    (void)state;
    const struct mesh_roll roll = {
        .radius_mm = 8.0, .core_mm = 2.0, .pitch_mm = 0.5, .tail_mm = 15.0, .length_mm = 40.0};
    struct mesh m;
    struct error err;
    assert_int_equal(mesh_roll_make(&roll, &m, &err), STATUS_OK);
    check_strip(&m);
    double(*normal)[3] = malloc(m.n_position * sizeof *normal), low_x = INFINITY, low_z = INFINITY;
    assert_int_equal(mesh_normals(&m, normal, &err), STATUS_OK);
    size_t left = 0;
    for (size_t i = 0; i < m.n_position; i++) {
        if (m.position_mm[i][0] < low_x) left = i;
        low_x = fmin(low_x, m.position_mm[i][0]);
        low_z = fmin(low_z, m.position_mm[i][2]);
    }
    assert_true(normal[left][0] < -0.99);
    assert_true(normal[0][2] < -0.99); /* the end of the tail */
    assert_true(fabs(m.position_mm[0][2] - (low_z)) <= 1e-9);
    /* a turn later the cloth lies a pitch further inside: points of the same angle are 120 apart */
    const size_t first = m.n_position / 2 / 2;
    const double *a = m.position_mm[first], *b = m.position_mm[first + 120];
    assert_true(fabs(hypot(a[0] - b[0], a[2] - b[2]) - (roll.pitch_mm)) <= 1e-6);
    free(normal);
    mesh_release(&m);
}

static void folds_hang_with_their_upper_side_to_the_front(void **state)
{
    (void)state;
    const struct mesh_folds folds = {.width_mm = 60.0, .height_mm = 50.0, .angle_rad = 1.1, .n_fold = 4};
    struct mesh m;
    struct error err;
    assert_int_equal(mesh_folds_make(&folds, &m, &err), STATUS_OK);
    check_strip(&m);
    double(*normal)[3] = malloc(m.n_position * sizeof *normal), high = 0.0, depth = 0.0;
    assert_int_equal(mesh_normals(&m, normal, &err), STATUS_OK);
    for (size_t i = 0; i < m.n_position; i++) {
        assert_true(normal[i][1] < -0.3);
        assert_true(fabs(normal[i][2] - (0.0)) <= 1e-9);
        high = fmax(high, m.position_mm[i][2]);
        depth = fmax(depth, m.position_mm[i][1]);
    }
    assert_true(fabs(high - (25.0)) <= 1e-9);
    assert_true(depth > 1.0);
    free(normal);
    mesh_release(&m);
}

static void what_makes_no_sense_is_refused(void **state)
{
    (void)state;
    struct mesh m;
    struct error err;
    const struct mesh_roll thick = {.radius_mm = 2, .core_mm = 3, .pitch_mm = 1, .tail_mm = 1, .length_mm = 1};
    assert_int_equal(mesh_roll_make(&thick, &m, &err), STATUS_INVALID);
    assert_int_equal(mesh_folds_make(&(struct mesh_folds){1, 1, 1.6, 4}, &m, &err), STATUS_INVALID);
    assert_int_equal(mesh_folds_make(&(struct mesh_folds){1, 1, 1, 0}, &m, &err), STATUS_INVALID);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_roll_has_its_upper_side_outside),
        cmocka_unit_test(folds_hang_with_their_upper_side_to_the_front),
        cmocka_unit_test(what_makes_no_sense_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
