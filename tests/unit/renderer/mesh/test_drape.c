/* A draped piece: it keeps its lengths, lies on its ball, hangs from it, and does not depend on the unit of length. */
#include "renderer/mesh/mesh_drape.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The fine mesh of mesh_drape.c. */
enum { SIDE = 257 };

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

/* Largest relative difference of an edge along weft or warp from its length in the cloth, and the root mean square. */
static double worst_strain(const struct mesh *m, double *rms)
{
    double worst = 0.0, sum = 0.0;
    size_t n = 0;
    for (size_t i = 0; i < m->n_position; i++)
        for (size_t axis = 0; axis < 2; axis++) {
            if ((axis == 0 ? i % SIDE : i / SIDE) == SIDE - 1) continue;
            size_t j = i + (axis == 0 ? 1 : SIDE);
            double rest = m->texture_mm[j][axis] - m->texture_mm[i][axis];
            double strain = distance(m->position_mm[i], m->position_mm[j]) / rest - 1.0;
            worst = fmax(worst, fabs(strain));
            sum += strain * strain;
            n++;
        }
    *rms = sqrt(sum / (double)n);
    return worst;
}

/* Middle of the ball: below the highest point of a cloth that lies on it. */
static void find_ball(const struct mesh *m, double radius_mm, double center[3])
{
    size_t top = 0;
    for (size_t i = 0; i < m->n_position; i++)
        if (m->position_mm[i][2] > m->position_mm[top][2]) top = i;
    memcpy(center, m->position_mm[top], 3 * sizeof *center);
    center[2] -= radius_mm;
}

static void a_piece_falls_over_a_ball(void **state)
{
    (void)state;
    const double size_mm = 40.0, radius_mm = 10.0;
    struct mesh m, large;
    struct error err = {0};
    double center[3], rms, nearest = INFINITY, lowest = INFINITY;
    if (mesh_drape(size_mm, radius_mm, NULL, &m, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(m.n_position, SIDE * SIDE);
    if (mesh_check(&m, &err) != STATUS_OK) fail_msg("%s", err.text);
    /* the spline lies inside of the points that it smooths, by a sixth of their second difference; this shortens edges
     * where the cloth bends by up to (h / r)^2 / 8 = 0.2 % at a radius of curvature of 5 mm */
    assert_true(worst_strain(&m, &rms) < 0.03);
    assert_true(rms < 0.005);
    find_ball(&m, radius_mm, center);
    size_t n_touching = 0;
    for (size_t i = 0; i < m.n_position; i++) {
        double d = distance(m.position_mm[i], center);
        nearest = fmin(nearest, d);
        n_touching += d < 1.005 * radius_mm;
        lowest = fmin(lowest, m.position_mm[i][2]);
    }
    assert_true(nearest > 0.99 * radius_mm);
    /* a piece of the ball around its top carries the cloth, and the corners hang below its middle */
    assert_in_range(n_touching, m.n_position / 100, m.n_position / 2);
    assert_true(lowest < center[2]);

    assert_int_equal(mesh_drape(10.0 * size_mm, 10.0 * radius_mm, NULL, &large, &err), STATUS_OK);
    for (size_t i = 0; i < m.n_position; i++)
        for (int k = 0; k < 3; k++) assert_true(fabs(large.position_mm[i][k] - 10.0 * m.position_mm[i][k]) < 1e-9);
    mesh_release(&large);
    mesh_release(&m);
}

static void what_cannot_be_draped_is_named(void **state)
{
    (void)state;
    struct mesh m;
    struct error err = {0};
    assert_int_equal(mesh_drape(40.0, 1.2, NULL, &m, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "touch each other"));
    assert_int_equal(mesh_drape(40.0, 0.5, NULL, &m, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "0.02 to 10 times"));
    assert_int_equal(mesh_drape(40.0, NAN, NULL, &m, &err), STATUS_INVALID);
    const atomic_bool cancel = true;
    const struct progress cancelled = {.cancel = &cancel};
    assert_int_equal(mesh_drape(40.0, 10.0, &cancelled, &m, &err), STATUS_CANCELLED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_piece_falls_over_a_ball),
        cmocka_unit_test(what_cannot_be_draped_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
