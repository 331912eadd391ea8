/* The stiffness of axes in their last fit follows the curvature of the fibers from place to place
 * (geometry/fibers/shape/axes/axis_solve.h). */
#include "geometry/fibers/shape/axes/axis_solve.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

enum { STRAIGHT = 60, BENT = 60, SHORT = 3 };
static const double DIAMETER = 7.0, VARIANCE = 0.04;

/* Adds a line of `straight` vertices one voxel apart along x, and then `bent` on an arc of this radius. */
static void add_line(struct polyline_set *lines, int straight, int bent, double radius, double z)
{
    assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
    for (int i = 0; i < straight + bent; i++) {
        const double turn = i < straight ? 0.0 : (i - straight) / radius, along = i < straight ? i : straight;
        const float x[3] = {(float)(along + radius * sin(turn)), (float)(radius * (1.0 - cos(turn))), (float)z};
        assert_int_equal(polyline_add(lines, x, NULL), STATUS_OK);
    }
}

/* Far from the change the squared curvature is that of the arc, or zero, weighed against the mean of all lines as four
 * diameters of line are against two. A component of a curvature of k counts half of its square. */
static void test_follows_curvature(void **state)
{
    (void)state;
    struct polyline_set lines;
    double stiffness[STRAIGHT + BENT + SHORT];
    const double radius = 20.0;
    polyline_set_init(&lines);
    add_line(&lines, STRAIGHT, BENT, radius, 5.0);
    add_line(&lines, SHORT, 0, radius, 30.0); /* too short to show a curvature: that of all lines */
    axis_local_stiffness(&lines, DIAMETER, VARIANCE, stiffness);
    const double sd = axis_curvature_sd(&lines, DIAMETER), all = sd * sd, arc = 0.5 / (radius * radius);
    const double window = 2.0 * 14.0 + 1.0, prior = 14.0;
    const double straight = prior * all / (window + prior), bent = (window * arc + prior * all) / (window + prior);
    const double found[3] = {VARIANCE / stiffness[STRAIGHT / 2], VARIANCE / stiffness[STRAIGHT + BENT / 2],
                             VARIANCE / stiffness[STRAIGHT + BENT]};
    print_message("squared curvature %.5f and %.5f, expected %.5f and %.5f; of all lines %.5f\n", found[0], found[1],
                  straight, bent, all);
    assert_true(fabs(found[0] / straight - 1.0) < 0.02);
    assert_true(fabs(found[1] / bent - 1.0) < 0.05); /* chords are shorter than the arc */
    assert_true(fabs(found[2] / all - 1.0) < 1e-6);
    for (size_t i = 1; i < STRAIGHT + BENT; i++) /* no jump: the window moves by a vertex */
        assert_true(fabs(log(stiffness[i] / stiffness[i - 1])) < 0.2);
    polyline_set_release(&lines);
}

/* Straight lines are held as stiffly as the bound of axis_curvature_sd allows, sharp bends as that of fibers about to
 * break. */
static void test_bounds(void **state)
{
    (void)state;
    struct polyline_set lines;
    double stiffness[2 * (STRAIGHT + BENT)];
    polyline_set_init(&lines);
    add_line(&lines, STRAIGHT + BENT, 0, 1.0, 5.0);
    axis_local_stiffness(&lines, DIAMETER, VARIANCE, stiffness);
    const double least = 0.05 / DIAMETER, most = AXIS_CURVATURE_MOST / DIAMETER;
    assert_true(fabs(VARIANCE / stiffness[STRAIGHT] / (least * least) - 1.0) < 1e-6);
    add_line(&lines, 0, STRAIGHT + BENT, DIAMETER, 30.0);
    axis_local_stiffness(&lines, DIAMETER, VARIANCE, stiffness);
    assert_true(fabs(VARIANCE / stiffness[2 * STRAIGHT + BENT] / (most * most) - 1.0) < 1e-6);
    polyline_set_release(&lines);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_follows_curvature), cmocka_unit_test(test_bounds)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
