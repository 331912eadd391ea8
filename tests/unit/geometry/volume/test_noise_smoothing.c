/* Smoothing of a scan's noise before its densities are clamped: how far it goes, and what it leaves as it is. */
#include "geometry/diameter/scan_densities.h"

#include "base/rng.h"
#include "geometry/volume/density_map.h"
#include "geometry/volume/noise_smoothing.h"
#include "geometry/volume/volume_align.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const size_t N[3] = {41, 37, 43}; /* more slices than a batch and its neighbours */

static void make(float (*value)(const size_t x[3]), struct volume *v)
{
    static const double size_m[3] = {2e-6, 2e-6, 2e-6};
    size_t x[3];
    assert_int_equal(volume_init(v, N, size_m, NULL), STATUS_OK);
    for (x[2] = 0; x[2] < N[2]; x[2]++)
        for (x[1] = 0; x[1] < N[1]; x[1]++)
            for (x[0] = 0; x[0] < N[0]; x[0]++) v->density[volume_index(N, x[0], x[1], x[2])] = value(x);
}

static void add_white(struct volume *v, double sd)
{
    const struct rng_key key = {.seed = 7};
    for (size_t at = 0; at < volume_n_voxel(N); at++) {
        struct rng rng;
        double normal[2];
        rng_start(&rng, &key, (uint32_t)at, 0);
        rng_normal_pair(&rng, normal);
        v->density[at] += (float)(sd * normal[0]);
    }
}

/* Half of the volume is void, half is material. */
static float halves(const size_t x[3]) { return x[2] < N[2] / 2 ? 100.0f : 300.0f; }

static float ramp(const size_t x[3]) { return 100.0f + 1.0f * (float)x[0] + 2.0f * (float)x[1] - 1.5f * (float)x[2]; }

static float speck(const size_t x[3]) { return x[0] == 20 && x[1] == 18 && x[2] == 21 ? 1e6f : 100.0f; }

static float hole(const size_t x[3]) { return x[0] < 20 ? VOLUME_OUTSIDE : 300.0f; }

static void test_strength_follows_the_noise(void **state)
{
    (void)state;
    assert_true(noise_smoothing_sd(0.0, 7.0) == 0.0 && noise_smoothing_sd(0.2, 7.0) == 0.0);
    assert_true(noise_smoothing_sd(NAN, 7.0) == 0.0);
    for (double sd = 0.22, last = 0.0; sd < 0.75; sd += 0.02) {
        const double now = noise_smoothing_sd(sd, 7.0);
        assert_true(now > last || now > 0.69);
        last = now;
    }
    assert_true(fabs(noise_smoothing_sd(2.0, 7.0) - 0.7) < 1e-6);
    assert_true(fabs(noise_smoothing_sd(2.0, 6.0) - 0.5) < 1e-6);
    assert_true(noise_smoothing_sd(2.0, 4.3) == 0.0); /* such fibers need all of the scan's resolution */
}

/* White noise of half a step is left as a fifth. The values of low and high count, not the scanner's unit. The median
 * of n half-normal values has a relative standard error of 1.17 / sqrt(n); smoothing leaves about a fifth of them
 * independent. Void is chosen by its mean, which takes up to 3 %. */
static void test_strong_noise_is_lowered_to_a_fifth(void **state)
{
    (void)state;
    struct volume v;
    struct scan_noise noise;
    make(halves, &v);
    add_white(&v, 0.5 * 200.0);
    assert_int_equal(scan_densities_map(&v, 100.0, 300.0, 7.0, NULL, &noise, NULL), STATUS_OK);
    print_message("noise %.3f, Gaussian of %.3f voxels, then %.3f\n", noise.scan_sd, noise.smooth_voxel,
                  noise.mapped_sd);
    assert_true(fabs(noise.scan_sd / 0.5 - 1.0) < 4.0 * 1.17 / sqrt(30000.0) + 0.03);
    assert_true(noise.smooth_voxel > 0.5 && noise.smooth_voxel < 0.6);
    assert_true(fabs(noise.mapped_sd / 0.2 - 1.0) < 4.0 * 1.17 / sqrt(30000.0 / 5.0) + 0.03);
    for (size_t at = 0; at < volume_n_voxel(N); at++) assert_true(v.density[at] >= 0.0f && v.density[at] <= 1.0f);
    volume_release(&v);
}

static void test_weak_noise_is_left_alone(void **state)
{
    (void)state;
    struct volume v, plain;
    struct scan_noise noise;
    make(halves, &v);
    make(halves, &plain);
    add_white(&v, 0.15 * 200.0);
    add_white(&plain, 0.15 * 200.0);
    assert_int_equal(scan_densities_map(&v, 100.0, 300.0, 7.0, NULL, &noise, NULL), STATUS_OK);
    assert_int_equal(density_map_apply(&plain, 100.0, 300.0, NULL, NULL), STATUS_OK);
    assert_true(noise.smooth_voxel == 0.0 && noise.mapped_sd == noise.scan_sd && fabs(noise.scan_sd - 0.15) < 0.01);
    assert_memory_equal(v.density, plain.density, volume_n_voxel(N) * sizeof *v.density);
    volume_release(&v);
    volume_release(&plain);
}

/* A Gaussian keeps linear values, along each axis and in every batch of slices; a face moves them by less than the
 * step over its reach. */
static void test_linear_values_stay(void **state)
{
    (void)state;
    struct volume v;
    size_t x[3];
    make(ramp, &v);
    assert_int_equal(volume_smooth_noise(&v, 0.6, NULL, NULL), STATUS_OK);
    for (x[2] = 0; x[2] < N[2]; x[2]++)
        for (x[1] = 0; x[1] < N[1]; x[1]++)
            for (x[0] = 0; x[0] < N[0]; x[0]++) {
                bool inside = true;
                for (int a = 0; a < 3; a++) inside = inside && x[a] >= 3 && x[a] + 3 < N[a];
                const float error = fabsf(v.density[volume_index(N, x[0], x[1], x[2])] - ramp(x));
                assert_true(error < (inside ? 1e-3f : 2.0f));
            }
    volume_release(&v);
}

static void test_result_does_not_depend_on_threads(void **state)
{
    (void)state;
    struct volume v[2];
    for (size_t i = 0; i < 2; i++) {
        struct thread_pool *pool = NULL;
        assert_int_equal(thread_pool_new(i == 0 ? 1 : 3, &pool, NULL), STATUS_OK);
        make(halves, &v[i]);
        add_white(&v[i], 90.0);
        assert_int_equal(volume_smooth_noise(&v[i], 0.7, pool, NULL), STATUS_OK);
        thread_pool_free(pool);
    }
    assert_memory_equal(v[0].density, v[1].density, volume_n_voxel(N) * sizeof *v[0].density);
    for (size_t i = 0; i < 2; i++) volume_release(&v[i]);
}

/* A single value far off counts as a step beyond material, and voxels outside of the scan as void. */
static void test_values_far_off_do_not_spread(void **state)
{
    (void)state;
    struct volume v;
    make(speck, &v);
    assert_int_equal(density_map_wide(&v, 100.0, 300.0, NULL, NULL), STATUS_OK);
    assert_true(v.density[volume_index(N, 20, 18, 21)] == 2.0f);
    assert_int_equal(volume_smooth_noise(&v, 0.6, NULL, NULL), STATUS_OK);
    assert_true(v.density[volume_index(N, 20, 18, 21)] < 1.0f && v.density[volume_index(N, 21, 18, 21)] < 0.5f);
    assert_true(fabsf(v.density[volume_index(N, 26, 18, 21)]) < 1e-6f);
    volume_release(&v);
    make(hole, &v);
    assert_int_equal(density_map_wide(&v, 100.0, 300.0, NULL, NULL), STATUS_OK);
    assert_true(v.density[volume_index(N, 10, 18, 21)] == 0.0f && v.density[volume_index(N, 30, 18, 21)] == 1.0f);
    volume_release(&v);
}

static void test_wrong_range_is_refused(void **state)
{
    (void)state;
    struct volume v;
    struct scan_noise noise;
    struct error err = {0};
    make(halves, &v);
    assert_int_equal(scan_densities_map(&v, 300.0, 100.0, 7.0, NULL, &noise, &err), STATUS_INVALID);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_strength_follows_the_noise),
                                       cmocka_unit_test(test_strong_noise_is_lowered_to_a_fifth),
                                       cmocka_unit_test(test_weak_noise_is_left_alone),
                                       cmocka_unit_test(test_linear_values_stay),
                                       cmocka_unit_test(test_result_does_not_depend_on_threads),
                                       cmocka_unit_test(test_values_far_off_do_not_spread),
                                       cmocka_unit_test(test_wrong_range_is_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
