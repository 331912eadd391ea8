/* The stiffness of axes in their last fit follows the curvature of the fibers from place to place, and their bends are
 * correlated along the fiber (geometry/fibers/axes/axis_solve.h). */
#include "geometry/fibers/axes/axis_solve.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>

#include <cmocka.h>

enum { STRAIGHT = 60, BENT = 60, SHORT = 3, N = 400 };
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

/* A wave in the plane z = 3, as fibers have that cross others: at x, with an amplitude and a wave length. */
struct wave {
    double amplitude, length;
};

static void wave_point(const struct wave *w, double x, float p[3])
{
    p[0] = (float)x;
    p[1] = (float)(w->amplitude * sin(2.0 * M_PI * x / w->length));
    p[2] = 3.0f;
}

/* Nearly normal: the sum of twelve even numbers. */
static float normal_number(uint32_t *random)
{
    double sum = -6.0;
    for (int k = 0; k < 12; k++) sum += (double)((*random = *random * 1664525u + 1013904223u) >> 8) / 16777216.0;
    return (float)sum;
}

/* RMS angle between the lines and the wave at their vertices, without `skip` at both ends. */
static double direction_error(const struct polyline_set *lines, const struct wave *w, size_t skip)
{
    double square = 0.0;
    for (size_t i = skip; i + skip < N; i++) {
        float t[3], a[3], b[3];
        double cosine = 0.0, length = 0.0;
        polyline_tangent(lines, 0, i, 1, t);
        wave_point(w, (double)i - 1.0, a);
        wave_point(w, (double)i + 1.0, b);
        for (int k = 0; k < 3; k++) {
            cosine += (double)(t[k] * (b[k] - a[k]));
            length += (double)((b[k] - a[k]) * (b[k] - a[k]));
        }
        square += 2.0 * (1.0 - cosine / sqrt(length)) / (double)(N - 2 * skip);
    }
    return sqrt(square);
}

/* Solves a wave whose data are its vertices with this noise and an information of 1, and returns the error. */
static double solved_error(const struct wave *w, double noise, double correlation)
{
    struct polyline_set lines;
    static struct axis_equation equation[N];
    double stiffness[N];
    const double bend = w->amplitude * pow(2.0 * M_PI / w->length, 2.0) / 2.0; /* mean square over both components */
    uint32_t random = 7;
    polyline_set_init(&lines);
    assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
    for (size_t i = 0; i < N; i++) {
        float x[3];
        wave_point(w, (double)i, x);
        x[1] += (float)noise * normal_number(&random);
        x[2] += (float)noise * normal_number(&random);
        equation[i] = (struct axis_equation){.normal = {1.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f}};
        assert_int_equal(polyline_add(&lines, x, NULL), STATUS_OK);
        stiffness[i] = noise * noise / (bend * bend);
    }
    assert_int_equal(axis_solve_lines(&lines, equation, stiffness, correlation, NULL, NULL), STATUS_OK);
    const double error = direction_error(&lines, w, (size_t)(5.0 * DIAMETER));
    polyline_set_release(&lines);
    return error;
}

/* A wave bends as fibers of a plain weave do, 3 degrees a voxel, and its bends change slowly. Knowing that lowers the
 * errors of its directions; that it hardly flattens the wave shows without noise. */
static void test_wave(void **state)
{
    (void)state;
    const struct wave w = {.amplitude = 7.0, .length = 60.0};
    const double correlation = axis_bend_correlation(DIAMETER);
    const double alone = solved_error(&w, 0.15, 0.0), correlated = solved_error(&w, 0.15, correlation);
    print_message("directions off by %.4f, with correlated bends by %.4f\n", alone, correlated);
    assert_true(correlated < 0.9 * alone);
    assert_true(solved_error(&w, 1e-3, correlation) < 2e-3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_follows_curvature), cmocka_unit_test(test_bounds),
                                       cmocka_unit_test(test_wave)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
