/* The correlation of a scan's noise, measured in void that is clamped at 0, on phantoms whose noise is known. */
#include "geometry/diameter/scan_densities.h"
#include "geometry/grade/scan_noise.h"
#include "geometry/phantom/phantom.h"
#include "geometry/volume/density_map.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* A scan of a single fiber along x, with noise that is not clamped. */
static void make_raw_scan(double snr, double noise_sd_voxel, struct volume *v)
{
    static const size_t n[3] = {48, 48, 48};
    struct phantom_scan_option o;
    struct fiber_set f;
    phantom_scan_option_default(&o);
    o.snr = snr;
    o.noise_sd_voxel = noise_sd_voxel;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, 2, NULL), STATUS_OK);
    for (size_t end = 0; end < 2; end++) {
        f.position_m[3 * end] = (float)((double)end * 48.0 * o.voxel_size_m);
        f.position_m[3 * end + 1] = f.position_m[3 * end + 2] = (float)(24.0 * o.voxel_size_m);
    }
    f.first_vertex[1] = 2;
    f.radius_m[0] = (float)(4.0 * o.voxel_size_m);
    f.axis_class[0] = 0;
    f.tile_size_m[0] = f.tile_size_m[1] = 48.0 * o.voxel_size_m;
    assert_int_equal(phantom_scan(&f, n, &o, NULL, NULL, v, NULL), STATUS_OK);
    fiber_set_release(&f);
}

static void make_scan(double snr, double noise_sd_voxel, struct volume *v)
{
    make_raw_scan(snr, noise_sd_voxel, v);
    assert_int_equal(density_map_apply(v, 0.0, 1.0, NULL, NULL), STATUS_OK);
}

static void test_correlation_of_known_noise(void **state)
{
    (void)state;
    static const struct {
        double snr, sd_voxel, tolerance;
    } of[] = {{5.0, 0.0, 0.0}, {5.0, 0.5, 0.05}, {2.0, 0.5, 0.05}, {3.0, 0.8, 0.06}};
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        struct volume v;
        make_scan(of[i].snr, of[i].sd_voxel, &v);
        double c = scan_noise_correlation(&v, 1.0 / of[i].snr), blur = scan_noise_blur(c);
        print_message("noise blurred by %.2f voxels: correlation %.3f, blur %.3f\n", of[i].sd_voxel, c, blur);
        assert_true(fabs(blur - of[i].sd_voxel) <= of[i].tolerance);
        volume_release(&v);
    }
}

/* White noise of a known standard deviation, in void that is clamped at 0 and in material that is clamped at 1. The
 * median of n half-normal values has a relative standard error of 1.17 / sqrt(n). */
static void test_known_standard_deviation(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        const double sd = i == 0 ? 0.05 : 0.12;
        struct volume v;
        make_scan(1.0 / sd, 0.0, &v);
        if (i == 1)
            for (size_t k = 0; k < 48 * 48 * 48; k++) v.density[k] = 1.0f - v.density[k];
        double found = density_noise_sd(&v, 0.0, 1.0);
        print_message("noise of %.3f: %.4f\n", sd, found);
        assert_true(fabs(found / sd - 1.0) < 4.0 * 1.17 / sqrt(20000.0));
        volume_release(&v);
    }
}

/* Without noise, and without void, there is nothing to measure. */
static void test_nothing_to_measure(void **state)
{
    (void)state;
    struct volume v;
    make_scan(5.0, 0.5, &v);
    assert_true(isnan(scan_noise_correlation(&v, 0.0)));
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) v.density[i] = 0.9f;
    assert_true(isnan(scan_noise_correlation(&v, 0.2)));
    assert_true(scan_noise_blur(NAN) == 0.0 && scan_noise_blur(-0.1) == 0.0);
    volume_release(&v);
}

/* How far a scan is smoothed follows from the diameter of its fibers. That is measured before the noise is clamped, and
 * correlated noise must not pass for fibers of three voxels, which are left alone. */
static void test_diameter_of_a_scan_that_is_not_clamped(void **state)
{
    (void)state;
    struct volume v;
    struct scan_noise noise;
    make_raw_scan(2.0, 0.5, &v);
    assert_int_equal(scan_densities_map(&v, 0.0, 1.0, NAN, NULL, &noise, NULL), STATUS_OK);
    print_message("noise %.3f, smoothed by %.3f voxels to %.3f\n", noise.scan_sd, noise.smooth_voxel, noise.mapped_sd);
    assert_true(noise.smooth_voxel > 0.4 && noise.mapped_sd < 0.6 * noise.scan_sd);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_known_standard_deviation), cmocka_unit_test(test_diameter_of_a_scan_that_is_not_clamped),
        cmocka_unit_test(test_correlation_of_known_noise), cmocka_unit_test(test_nothing_to_measure)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
