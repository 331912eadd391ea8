/* Stated errors of axes (geometry/fibers/axes/axis_error.h): their closed form, and the errors found in scans with
 * white and with correlated noise. */
#include "geometry/fibers/axes/axis_error.h"
#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/axes/flat_fit.h"
#include "geometry/volume/noise_smoothing.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* Where axes are smoothed over l voxels, position^2 = v / (2 sqrt 2 n l) and direction^2 = position^2 / l^2. */
static void test_smooth_axes(void **state)
{
    (void)state;
    const double length = 8.0, information = 3.0, noise = 0.2,
                 stiffness[3] = {information * pow(length, 4.0), information * pow(length, 4.0),
                                 information * pow(length, 4.0)};
    const struct axis_data data = {.information = information, .slope = 1.0, .noise = noise};
    double position, direction;
    axis_errors(&data, stiffness, 3, &position, &direction);
    const double expected = sqrt(noise / (2.0 * M_SQRT2 * information * length));
    print_message("position %.5f of %.5f, direction %.5f of %.5f\n", position, expected, direction, expected / length);
    assert_true(fabs(position / expected - 1.0) < 0.05 && fabs(direction * length / expected - 1.0) < 0.05);
    /* correlated bends let less noise of short waves pass, but not less than independent residuals have */
    struct axis_data bends = {.information = information, .slope = 1.0, .noise = noise, .correlation = 0.9};
    const double loose[1] = {information};
    double straighter, residual;
    axis_errors(&data, loose, 1, &position, &direction);
    axis_errors(&bends, loose, 1, &position, &straighter);
    bends.residual = noise;
    axis_errors(&bends, loose, 1, &position, &residual);
    assert_true(straighter < 0.8 * direction && fabs(residual / direction - 1.0) < 1e-9);
}

enum { LENGTH = 400, WIDTH = 24 };
static const double center_y = 12.3, center_z = 12.1;

/* A fiber along x in noise of standard deviation `sd` that was blurred by `blur` voxels. */
static void make_scan(double sd, double blur, uint64_t seed, struct volume *v)
{
    const size_t n[3] = {LENGTH, WIDTH, WIDTH};
    const double voxel_m[3] = {2e-6, 2e-6, 2e-6};
    const struct test_cylinder c = {{0.0, center_y, center_z}, {1.0, 0.0, 0.0}, 3.5};
    struct volume noise;
    double square = 0.0;
    assert_int_equal(volume_init(v, n, voxel_m, NULL), STATUS_OK);
    assert_int_equal(volume_init(&noise, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(v, &c, 1, 0.0, 1);
    assert_int_equal(volume_smooth_noise(v, 0.6, NULL, NULL), STATUS_OK);
    test_fill_cylinders(&noise, NULL, 0, 1.0, seed);
    if (blur > 0.0) assert_int_equal(volume_smooth_noise(&noise, blur, NULL, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(n); i++) square += pow((double)noise.density[i], 2.0);
    for (size_t i = 0; i < volume_n_voxel(n); i++)
        v->density[i] += (float)(sd * (double)noise.density[i] / sqrt(square / (double)volume_n_voxel(n)));
    volume_release(&noise);
}

/* Adds the squares of both components of the axis' error, over the stated one. */
static void add_errors(const struct polyline_set *lines, double position_se, double *square, double *n)
{
    for (size_t i = 10; i + 10 < lines->n_vertex; i++, *n += 2.0)
        *square +=
            (pow((double)lines->vertex[i][1] - center_y, 2.0) + pow((double)lines->vertex[i][2] - center_z, 2.0)) /
            (position_se * position_se);
}

/* A straight fiber loses nothing by smoothing, so it has a part of the stated error only. */
static void test_correlated_noise(void **state)
{
    (void)state;
    static const double blur[] = {0.0, 0.5, 0.8};
    for (size_t b = 0; b < sizeof blur / sizeof *blur; b++) {
        double square = 0.0, n = 0.0, stated = 0.0;
        for (uint64_t seed = 1; seed <= 4; seed++) {
            struct volume v;
            struct polyline_set lines;
            struct section_ratio ratio;
            struct shape_measure m;
            struct axis_profile profile = {.radius = 3.2,
                                           .radius_spread = 0.3,
                                           .blur = 0.8,
                                           .high = 1.0,
                                           .independent = 1.0,
                                           .measured_curvature = true};
            make_scan(0.2, blur[b], seed, &v);
            polyline_set_init(&lines);
            assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
            for (int i = 0; i < LENGTH; i++)
                assert_int_equal(polyline_add(&lines, (float[3]){(float)i + 0.5f, 12.5f, 12.5f}, NULL), STATUS_OK);
            const struct flat_fit fit = {&v, 7.0, 6, 4, NULL, NULL, &m, false};
            assert_int_equal(polylines_fit_flat(&lines, &fit, &profile, &ratio, NULL), STATUS_OK);
            add_errors(&lines, profile.position_se, &square, &n);
            stated += 0.25 * profile.position_se;
            polyline_set_release(&lines);
            volume_release(&v);
        }
        const double pull = sqrt(square / n);
        print_message("noise blurred by %.1f voxels: %.3f voxels stated, errors over stated ones %.2f\n", blur[b],
                      stated, pull);
        assert_true(pull > 0.6 && pull < 1.2);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_smooth_axes), cmocka_unit_test(test_correlated_noise)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
