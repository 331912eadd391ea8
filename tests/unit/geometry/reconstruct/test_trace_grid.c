/* Volumes in voxels of another size, and fibers too thin or too thick for the scan's own voxels: known answers. */
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/reconstruct/trace_grid.h"
#include "geometry/volume/volume_rescale.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>

#include <cmocka.h>

static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};

/* A mean over voxels of 1.6 of a ramp is the ramp at their middle, also of the part of a voxel at the far face; and the
 * mean of everything does not change. */
static void test_larger_voxels(void **state)
{
    (void)state;
    const size_t n[3] = {13, 7, 9};
    const double edge = 1.6;
    struct volume v, out;
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) v.density[volume_index(n, i, j, k)] = (float)(i + j == 8 && k == 4);
    assert_int_equal(volume_rescale(&v, edge, NULL, NULL, &out, NULL), STATUS_OK);
    assert_true(out.n[0] == 9 && out.n[1] == 5 && out.n[2] == 6);
    assert_true(fabs(out.voxel_size_m[0] - 3.2e-6) < 1e-15);
    double sum = 0.0;
    for (size_t at = 0; at < volume_n_voxel(out.n); at++) {
        const size_t x[3] = {at % 9, at / 9 % 5, at / 45};
        double size = 1.0;
        for (int a = 0; a < 3; a++) size *= fmin(edge, (double)n[a] - edge * (double)x[a]);
        sum += size * (double)out.density[at];
    }
    assert_true(fabs(sum - 7.0) < 1e-5); /* voxels with i + j = 8 */
    volume_release(&out);
    for (size_t at = 0; at < volume_n_voxel(n); at++)
        v.density[at] = (float)((double)(at % n[0]) + 0.5 + 10.0 * (double)(at / (n[0] * n[1])));
    assert_int_equal(volume_rescale(&v, edge, NULL, NULL, &out, NULL), STATUS_OK);
    for (size_t i = 0; i < 9; i++) {
        double from = edge * (double)i, to = fmin(from + edge, 13.0), want = 0.0;
        for (size_t at = 0; at < 13; at++) { /* the ramp is constant within a voxel */
            double part = fmin(to, (double)at + 1.0) - fmax(from, (double)at);
            if (part > 0.0) want += part * ((double)at + 0.5) / (to - from);
        }
        double slice = (0.4 * 1.0 + 1.0 * 2.0 + 0.2 * 3.0) / 1.6; /* of voxels 1, 2, 3 between 1.6 and 3.2 */
        assert_true(fabs((double)out.density[volume_index(out.n, i, 2, 1)] - want - 10.0 * slice) < 1e-4);
    }
    volume_release(&out);
    volume_release(&v);
}

/* Directions given to a finer grid and back are the same, also where the finer one has holes. */
static void test_directions_there_and_back(void **state)
{
    (void)state;
    const size_t n[3] = {12, 12, 12}, m[3] = {7, 7, 7};
    const double coarse_m[3] = {3.6e-6, 3.6e-6, 3.6e-6};
    struct volume fine, coarse;
    struct direction_volume first, spread, back;
    size_t n_material, n_kept;
    assert_int_equal(volume_init(&fine, n, voxel_m, NULL), STATUS_OK);
    assert_int_equal(volume_init(&coarse, m, coarse_m, NULL), STATUS_OK);
    assert_int_equal(direction_volume_init(&first, m, coarse_m, NULL), STATUS_OK);
    for (size_t at = 0; at < volume_n_voxel(n); at++) fine.density[at] = at % 7 == 3 ? 0.1f : 0.9f; /* with holes */
    for (size_t at = 0; at < volume_n_voxel(m); at++) {
        const float d[3] = {1.0f + (float)(at % 7), 2.0f, (float)(at / 49)};
        coarse.density[at] = 0.8f;
        direction_volume_set(&first, at, d);
        first.density[at] = at % 49 == 30 ? 0 : 200;
    }
    assert_int_equal(direction_volume_rescale(&first, &fine, 0.5, NULL, &spread, &n_material, &n_kept, NULL),
                     STATUS_OK);
    assert_true(n_material == 1728 - 247 && n_kept < n_material);
    assert_int_equal(spread.density[0], 230);
    assert_int_equal(direction_volume_rescale(&spread, &coarse, 0.5, NULL, &back, &n_material, &n_kept, NULL),
                     STATUS_OK);
    assert_int_equal(n_kept, 343 - 7);
    for (size_t at = 0; at < volume_n_voxel(m); at++) {
        assert_true((back.density[at] == 0) == (first.density[at] == 0));
        if (back.density[at] == 0) continue;
        assert_int_equal(back.octahedral[2 * at], first.octahedral[2 * at]);
        assert_int_equal(back.octahedral[2 * at + 1], first.octahedral[2 * at + 1]);
    }
    volume_release(&fine);
    volume_release(&coarse);
    direction_volume_release(&first);
    direction_volume_release(&spread);
    direction_volume_release(&back);
}

static void test_options_there_and_back(void **state)
{
    (void)state;
    struct reconstruct_option o;
    const size_t n[3] = {3000, 3000, 10}, large[3] = {5000, 5000, 10};
    assert_true(trace_grid_edge(7.0, n) == 1.0 && trace_grid_edge(14.0, large) == 2.0);
    assert_true(trace_grid_edge(4.0, n) < 0.6 && trace_grid_edge(4.0, n) > 0.5);
    assert_true(trace_grid_edge(4.0, large) == 1.0 && trace_grid_edge(2.5, n) == 1.0);
    reconstruct_option_default(&o);
    o.s = 0.5;
    o.t = 1.0;
    o.h = 35;
    o.eps_j = -20.0;
    trace_grid_rescale_option(&o, 2.0);
    assert_true(o.s == 2.0 && o.t == 4.0 && o.h == 17 && o.eps_j == -2.5);
    trace_grid_rescale_option(&o, 0.5);
    assert_true(o.s == 0.5 && o.t == 1.0 && o.h == 33 && o.eps_j == -20.0);
}

/* Traces three fibers that touch, along x, and returns the RMS distance of all vertices from their axes, voxels. */
static double trace_three(double diameter, const size_t n[3], struct reconstruct_report *r, struct fiber_set *f)
{
    struct test_cylinder c[3];
    struct volume v;
    struct direction_volume d;
    struct reconstruct_option o;
    double square = 0.0;
    for (int i = 0; i < 3; i++)
        c[i] = (struct test_cylinder){
            {0.0, 1.3 * diameter + 1.02 * diameter * i, 0.5 * (double)n[2] + 0.2}, {1.0, 0.0, 0.0}, 0.5 * diameter};
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&v, c, 3, 0.2, 5);
    for (size_t i = 0; i < volume_n_voxel(n); i++) v.density[i] = fminf(1.0f, fmaxf(0.0f, v.density[i]));
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = diameter;
    *r = (struct reconstruct_report){0};
    assert_int_equal(reconstruct_orientation(&v, &o, NULL, NULL, &d, r, NULL), STATUS_OK);
    assert_true(d.n[0] == n[0] && d.n[1] == n[1] && d.n[2] == n[2]);
    assert_int_equal(reconstruct_fibers(&v, &d, &o, NULL, NULL, f, r, NULL), STATUS_OK);
    for (size_t i = 0; i < f->n_vertex; i++) {
        double least = INFINITY;
        for (int k = 0; k < 3; k++)
            least = fmin(least, hypot((double)f->position_m[3 * i + 1] / voxel_m[1] - c[k].point[1],
                                      (double)f->position_m[3 * i + 2] / voxel_m[2] - c[k].point[2]));
        square += least * least;
    }
    direction_volume_release(&d);
    volume_release(&v);
    return sqrt(square / (double)f->n_vertex);
}

/* Fibers of 3.6 voxels that touch are three lines, and so are fibers of 15; each lies on its axis, from face to face,
 * with the right radius. */
static void test_thin_and_thick_fibers(void **state)
{
    (void)state;
    static const struct {
        double diameter, rms_voxel, radius_error;
        size_t n[3];
    } q[] = {{3.6, 0.2, 0.1, {48, 18, 14}}, {15.0, 0.15, 0.03, {72, 70, 40}}};
    for (size_t i = 0; i < 2; i++) {
        struct reconstruct_report r;
        struct fiber_set f;
        double rms = trace_three(q[i].diameter, q[i].n, &r, &f), radius = 2.0 * r.radius_m[0] / voxel_m[0];
        print_message("%.1f voxels in voxels of %.2f: %zu lines, rms %.3f voxels, diameter %.2f, position error %.3f\n",
                      q[i].diameter, r.trace_edge_voxel, f.n_fiber, rms, radius, r.axis_position_se_m / voxel_m[0]);
        assert_int_equal(f.n_fiber, 3);
        assert_true(rms < q[i].rms_voxel);
        assert_true(fabs(radius / q[i].diameter - 1.0) < q[i].radius_error);
        assert_true(r.trace_edge_voxel == trace_grid_edge(q[i].diameter, q[i].n) && r.trace_edge_voxel != 1.0);
        for (size_t l = 0; l < 3; l++) {
            double a = (double)f.position_m[3 * f.first_vertex[l]] / voxel_m[0],
                   b = (double)f.position_m[3 * (f.first_vertex[l + 1] - 1)] / voxel_m[0];
            assert_true(fabs(fmin(a, b)) < 0.01 && fabs(fmax(a, b) - (double)q[i].n[0]) < 0.01);
        }
        fiber_set_release(&f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_larger_voxels),
        cmocka_unit_test(test_directions_there_and_back),
        cmocka_unit_test(test_options_there_and_back),
        cmocka_unit_test(test_thin_and_thick_fibers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
