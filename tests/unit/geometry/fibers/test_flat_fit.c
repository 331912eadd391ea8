/* Sections of two axes in the fit of fiber axes: derivatives, and which line beside a flat fiber is a part of it. */
#include "base/rng.h"
#include "geometry/fibers/axes/flat_fit.h"
#include "geometry/phantom/phantom_section.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* The depth of a point, and where its derivatives say it is after a change of radius, position, c and s. */
static void test_place_in_a_section(void **state)
{
    (void)state;
    const float a[3] = {0.0f, 0.0f, 0.0f}, b[3] = {0.6f, 0.8f, 0.0f}, step = 1e-3f;
    const struct fiber_section flat = {{0.8f, -0.6f, 0.0f}, 0.2f, -0.3f};
    const float f = sqrtf(0.13f);
    assert_true(fabsf(fiber_section_ratio(&flat) - expf(2.0f * f)) < 1e-4f);
    struct section_view w = fiber_section_view(&flat, &flat, a, b);
    assert_true(fabsf(w.stretch - expf(f)) < 1e-4f && fabsf(w.uu * w.vv - w.uv * w.uv - 1.0f) < 1e-4f);
    for (int i = 0; i < 12; i++) {
        /* a point on the outline: along a ray, at the distance where share is 1 */
        const float angle = 0.5235988f * (float)i, x = cosf(angle), y = sinf(angle);
        float ray[3];
        for (int c = 0; c < 3; c++) ray[c] = x * w.u[c] + y * w.v[c];
        const float outline = 1.0f / fiber_section_place(&w, 3.0f, ray).share;
        for (int c = 0; c < 3; c++) ray[c] *= outline;
        const struct section_place p = fiber_section_place(&w, 3.0f, ray);
        assert_true(fabsf(p.share - 1.0f) < 1e-4f && fabsf(p.depth) < 1e-4f);
        float by_radius = (fiber_section_place(&w, 3.0f + step, ray).depth - p.depth) / step;
        assert_true(fabsf(by_radius - p.by_radius) < 0.01f);
        for (int c = 0; c < 3; c++) {
            float moved[3] = {ray[0], ray[1], ray[2]};
            moved[c] += step;
            assert_true(fabsf((fiber_section_place(&w, 3.0f, moved).depth - p.depth) / step - p.normal[c]) < 0.01f);
        }
        /* by_c and by_s take changes of L to commute with it, and are up to 2 f / tanh(2 f) = 1.17 times too large */
        for (int c = 0; c < 2; c++) {
            struct fiber_section changed = flat;
            *(c == 0 ? &changed.c : &changed.s) += step;
            struct section_view v = fiber_section_view(&changed, &changed, a, b);
            float by = (fiber_section_place(&v, 3.0f, ray).depth - p.depth) / step;
            assert_true(fabsf(by - (c == 0 ? p.by_c : p.by_s)) < 0.17f * 3.0f * expf(f));
        }
    }
}

/* A fiber along x of radius r about (y, z). */
struct test_fiber {
    double y, z, r;
    struct phantom_section section;
};

static void draw(struct volume *v, const struct test_fiber *f, size_t n_fiber, double noise)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 3}, 0, 0);
    for (size_t k = 0; k < v->n[2]; k++)
        for (size_t j = 0; j < v->n[1]; j++)
            for (size_t i = 0; i < v->n[0]; i++) {
                double sum = 0.0, normal[2];
                for (size_t m = 0; m < n_fiber; m++) {
                    double angle = f[m].section.angle_rad + f[m].section.turn_rad_per_m * (double)i, c = cos(angle),
                           s = sin(angle), y = (double)j + 0.5 - f[m].y, z = (double)k + 0.5 - f[m].z;
                    sum += phantom_section_share(&f[m].section, f[m].r, c * y + s * z, c * z - s * y);
                }
                rng_normal_pair(&rng, normal);
                v->density[volume_index(v->n, i, j, k)] = (float)(fmin(1.0, sum) + noise * normal[0]);
            }
}

static void add_line(struct polyline_set *p, float from, float to, float y, float z, float radius)
{
    assert_int_equal(polyline_begin(p, 0, NULL), STATUS_OK);
    p->radius[p->n_line - 1] = radius;
    for (float x = from; x <= to; x += 1.0f) assert_int_equal(polyline_add(p, (float[3]){x, y, z}, NULL), STATUS_OK);
}

/* A flat fiber whose section turns by 40 degrees, traced as a line beside its axis and one at its tip, and a thin round
 * fiber that touches it and was traced too near: only the line at the tip is removed, the other two end on their axes,
 * and the ratio of the axes is that of the fiber. Of three round fibers no line is removed. */
static void test_parts_of_a_flat_fiber(void **state)
{
    (void)state;
    const size_t n[3] = {80, 36, 28};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    for (int round = 0; round < 2; round++) {
        const double ratio = round == 1 ? 1.0 : 2.2;
        const struct test_fiber f[3] = {
            {18.0, 12.0, 3.5, {.aspect = ratio, .angle_rad = -0.35, .turn_rad_per_m = 0.7 / 80.0}},
            {18.0, round == 1 ? 18.2 : 16.9, 2.4, {.aspect = 1.0}},
            {round == 1 ? 24.4 : 9.0, round == 1 ? 12.0 : 20.0, 2.6, {.aspect = 1.0}}};
        struct volume v;
        struct polyline_set lines;
        struct section_ratio found;
        struct axis_profile profile = {
            .radius = 3.2, .radius_spread = 0.3, .blur = 0.8, .high = 1.0, .independent = 1.0};
        assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
        draw(&v, f, round == 1 ? 3 : 2, 0.1);
        polyline_set_init(&lines);
        add_line(&lines, 0.5f, 79.5f, round == 1 ? 18.0f : 16.6f, 12.0f, 2.9f);
        add_line(&lines, 0.5f, 78.5f, 18.0f, (float)f[1].z - 0.3f, 2.6f);
        add_line(&lines, 2.5f, 70.5f, round == 1 ? 24.0f : 21.0f, 12.0f, 2.2f);
        const struct flat_fit fit = {&v, 7.0, 4, 4, NULL, NULL};
        for (int pass = 0; pass < 2; pass++) { /* as the reconstruction does */
            assert_int_equal(polylines_fit_flat(&lines, &fit, &profile, &found, NULL), STATUS_OK);
            print_message("ratio %.2f: found %.2f +- %.2f, %zu vertices removed, %zu lines\n", ratio, found.mean,
                          found.sd, found.n_removed, lines.n_line);
            assert_int_equal(lines.n_line, round == 1 ? 3 : 2);
        }
        for (size_t l = 0; l < lines.n_line; l++) {
            double y = 0.0, z = 0.0, length = (double)polyline_length(&lines, l);
            for (size_t i = lines.first[l]; i < lines.first[l + 1]; i++) {
                y += (double)lines.vertex[i][1] / length;
                z += (double)lines.vertex[i][2] / length;
            }
            print_message("line %zu at %.2f, %.2f of %.2f, %.2f, radius %.2f of %.2f\n", l, y, z, f[l].y, f[l].z,
                          (double)lines.radius[l], f[l].r);
            assert_true(hypot(y - f[l].y, z - f[l].z) < 0.25);
            assert_true(fabs((double)lines.radius[l] / f[l].r - 1.0) < 0.08);
        }
        assert_true(round == 1 ? found.mean < 1.1 : found.mean > 1.15);
        polyline_set_release(&lines);
        volume_release(&v);
    }
}

/* One flat fiber: the ratio of its axes, and its radius as that of the disc of equal area. */
static void test_ratio_of_axes(void **state)
{
    (void)state;
    const size_t n[3] = {96, 28, 28};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    static const double ratio[3] = {1.0, 1.6, 2.5};
    for (int k = 0; k < 3; k++) {
        const struct test_fiber f = {14.2, 13.9, 3.5, {.aspect = ratio[k], .turn_rad_per_m = 1.2 / 96.0}};
        struct volume v;
        struct polyline_set lines;
        struct section_ratio found;
        struct axis_profile profile = {
            .radius = 3.2, .radius_spread = 0.3, .blur = 0.8, .high = 1.0, .independent = 1.0};
        assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
        draw(&v, &f, 1, 0.2);
        polyline_set_init(&lines);
        add_line(&lines, 0.5f, 95.5f, 14.8f, 13.5f, 3.0f);
        const struct flat_fit fit = {&v, 7.0, 6, 4, NULL, NULL};
        assert_int_equal(polylines_fit_flat(&lines, &fit, &profile, &found, NULL), STATUS_OK);
        print_message("ratio %.2f: found %.3f, radius %.3f of %.3f\n", ratio[k], found.mean, (double)lines.radius[0],
                      f.r);
        assert_true(fabs(found.mean / ratio[k] - 1.0) < 0.06);
        assert_true(fabs((double)lines.radius[0] / f.r - 1.0) < 0.04);
        polyline_set_release(&lines);
        volume_release(&v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_place_in_a_section), cmocka_unit_test(test_ratio_of_axes),
                                       cmocka_unit_test(test_parts_of_a_flat_fiber)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
