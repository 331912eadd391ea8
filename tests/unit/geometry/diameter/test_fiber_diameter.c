/* The fiber diameter that is measured in a scan: with noise of any kind, below that of yarns, given, and reported. */
#include "base/option_id.h"
#include "geometry/diameter/fiber_diameter.h"
#include "geometry/diameter/scale_space.h"
#include "geometry/reconstruct/reconstruct.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};

enum { N_SIDE = 64, N_BUNDLE = 16 };

/* A bundle of 16 fibers of a diameter (voxels) in a cube of 64 voxels, with noise of signal-to-noise 2 if noisy. */
static void make_bundle(struct volume *v, double diameter, bool noisy)
{
    const size_t n[3] = {N_SIDE, N_SIDE, N_SIDE};
    struct test_cylinder c[N_BUNDLE];
    for (int i = 0; i < N_BUNDLE; i++) {
        double y = 32.0 + 1.15 * diameter * (i % 4 - 1.5), z = 32.0 + 1.15 * diameter * (i / 4 - 1.5);
        c[i] = (struct test_cylinder){{32.0, y, z}, {1.0, 0.1 * (i % 3), 0.05 * (i % 2)}, 0.5 * diameter};
    }
    assert_int_equal(volume_init(v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(v, c, N_BUNDLE, noisy ? 0.5 : 0.0, 7);
}

/* Measures after clamping to 0..1, as scans are mapped, and releases the volume. */
static struct fiber_diameter measure_clamped(struct volume *v)
{
    struct fiber_diameter d;
    for (size_t i = 0; i < volume_n_voxel(v->n); i++) v->density[i] = fminf(1.0f, fmaxf(0.0f, v->density[i]));
    assert_int_equal(fiber_diameter_measure(v, NULL, NULL, &d, NULL), STATUS_OK);
    volume_release(v);
    return d;
}

/* The diameter of fibers side by side is the same at signal-to-noise 2 as without noise. */
static void test_diameter_in_strong_noise(void **state)
{
    (void)state;
    static const double diameter[3] = {4.0, 7.0, 12.0};
    for (int k = 0; k < 3; k++) {
        struct fiber_diameter measured[2];
        for (int noisy = 0; noisy < 2; noisy++) {
            struct volume v;
            make_bundle(&v, diameter[k], noisy);
            measured[noisy] = measure_clamped(&v);
        }
        print_message("diameter %g: measured %.2f, in strong noise %.2f\n", diameter[k], measured[0].voxel,
                      measured[1].voxel);
        assert_true(fabs(measured[0].voxel / diameter[k] - 1.0) < 0.1);
        assert_true(fabs(measured[1].voxel / measured[0].voxel - 1.0) < 0.03);
    }
}

/* Adds noise of a standard deviation whose neighbours are correlated by a Gaussian of 0.5 voxels. */
static void add_correlated_noise(struct volume *v, double sd)
{
    size_t n_voxel = volume_n_voxel(v->n);
    struct volume white;
    assert_int_equal(volume_init(&white, v->n, v->voxel_size_m, NULL), STATUS_OK);
    float *scratch = malloc(n_voxel * sizeof *scratch);
    double square = 0.0;
    test_fill_cylinders(&white, NULL, 0, 1.0, 3);
    scale_blur(white.density, scratch, white.n, 0.5);
    for (size_t i = 0; i < n_voxel; i++) square += (double)(white.density[i] * white.density[i]);
    float scale = (float)(sd / sqrt(square / (double)n_voxel));
    for (size_t i = 0; i < n_voxel; i++) v->density[i] += scale * white.density[i];
    free(scratch);
    volume_release(&white);
}

/* Noise correlated over half a voxel has the strongest response at a diameter of 3. It must not be taken for fibers. */
static void test_diameter_in_correlated_noise(void **state)
{
    (void)state;
    static const double diameter[3] = {4.0, 7.0, 12.0};
    for (int k = 0; k < 3; k++) {
        struct volume v;
        make_bundle(&v, diameter[k], false);
        add_correlated_noise(&v, 0.5);
        struct fiber_diameter d = measure_clamped(&v);
        print_message("diameter %g: measured %.2f (noise %.0f %%), other %.2f (noise %.0f %%)\n", diameter[k], d.voxel,
                      100.0 * d.noise_share, d.other_voxel, 100.0 * d.other_noise_share);
        assert_true(d.noise_measured);
        assert_true(fabs(d.voxel / diameter[k] - 1.0) < 0.15);
    }
}

/* Two yarns along x in a cube of 64 voxels: of 13 fibers of 4 voxels each, or solid rods. Blurred by 0.7 voxels. */
static void make_yarns(struct volume *v, bool solid)
{
    static const double yarn_y[2] = {18.0, 46.0};
    const size_t n[3] = {N_SIDE, N_SIDE, N_SIDE};
    const double pitch = 4.3, yarn_radius = 8.0;
    struct test_cylinder c[64];
    size_t n_cylinder = 0;
    float *scratch = malloc(sizeof *scratch * N_SIDE * N_SIDE * N_SIDE);
    assert_non_null(scratch);
    for (int yarn = 0; yarn < 2; yarn++)
        for (int i = solid ? 0 : -25; i <= (solid ? 0 : 25) && n_cylinder < 64; i++) {
            const int row = (int)lround(i / 7.0), column = i - 7 * row;
            const double y = pitch * (column + 0.5 * (row & 1)), z = pitch * 0.5 * sqrt(3.0) * row;
            if (hypot(y, z) > yarn_radius) continue;
            c[n_cylinder++] = (struct test_cylinder){
                {32.0, yarn_y[yarn] + y, 32.0 + z}, {1.0, 0.0, 0.0}, solid ? yarn_radius + 1.0 : 2.0};
        }
    assert_int_equal(n_cylinder, solid ? 2 : 26);
    assert_int_equal(volume_init(v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(v, c, n_cylinder, 0.0, 7);
    scale_blur(v->density, scratch, v->n, 0.7);
    free(scratch);
}

static void add_white_noise(struct volume *v, double sd, uint64_t seed)
{
    struct volume noise;
    assert_int_equal(volume_init(&noise, v->n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&noise, NULL, 0, sd, seed);
    for (size_t i = 0; i < volume_n_voxel(v->n); i++) v->density[i] += noise.density[i];
    volume_release(&noise);
}

/* Fibers of 4 voxels whose response is mostly noise at signal-to-noise 1.7 are found below that of their yarns, which
 * is stronger; but noise alone makes no fibers of solid rods. */
static void test_diameter_below_that_of_yarns(void **state)
{
    (void)state;
    for (uint64_t seed = 2; seed <= 3; seed++) {
        struct volume v;
        make_yarns(&v, false);
        add_white_noise(&v, 0.6, seed);
        const struct fiber_diameter d = measure_clamped(&v);
        print_message("fibers of 4 voxels in yarns: %.2f (noise %.0f %%), other %.2f\n", d.voxel, 100.0 * d.noise_share,
                      d.other_voxel);
        assert_true(fabs(d.voxel / 4.0 - 1.0) < 0.1);
        assert_true(d.other_voxel > 16.0 && d.other_voxel < 22.0);
    }
    struct volume rods;
    make_yarns(&rods, true);
    add_correlated_noise(&rods, 0.6);
    const struct fiber_diameter d = measure_clamped(&rods);
    print_message("solid rods of 18 voxels: %.2f, other %.2f\n", d.voxel, d.other_voxel);
    assert_true(fabs(d.voxel / 18.0 - 1.0) < 0.2);
}

/* Where the void between fibers is filled in part, their yarns hide the fall of the response beyond the fibers' scale.
 * The fibers are found all the same; solid rods stay rods, with noise or without. */
static void test_shoulder_of_yarns(void **state)
{
    (void)state;
    static const float filling[3] = {0.4f, 0.5f, 0.6f};
    for (int k = 0; k < 3; k++) {
        struct volume v, rods;
        make_yarns(&v, false);
        make_yarns(&rods, true);
        for (size_t i = 0; i < volume_n_voxel(v.n); i++)
            v.density[i] = fmaxf(v.density[i], filling[k] * rods.density[i]);
        add_white_noise(&v, 0.1, 4);
        const struct fiber_diameter d = measure_clamped(&v);
        add_white_noise(&rods, k == 0 ? 0.0 : 0.1 * k, 5);
        const struct fiber_diameter rod = measure_clamped(&rods);
        print_message("void filled to %.1f: diameter %.2f, other %.2f; solid rods with noise of %.1f: %.2f\n",
                      (double)filling[k], d.voxel, d.other_voxel, 0.1 * k, rod.voxel);
        assert_true(fabs(d.voxel / 4.0 - 1.0) < 0.15);
        assert_true(d.other_voxel > 16.0 && d.other_voxel < 22.0);
        assert_true(fabs(rod.voxel / 18.0 - 1.0) < 0.2);
    }
}

/* Noise that hides thin fibers is lowered as that of thick ones, and their diameter is kept. */
static void test_hidden_fibers_are_smoothed(void **state)
{
    (void)state;
    struct volume v;
    struct scan_noise noise;
    make_yarns(&v, false);
    add_white_noise(&v, 0.6, 2);
    assert_int_equal(scan_densities_map(&v, 0.0, 1.0, NAN, NULL, &noise, NULL), STATUS_OK);
    print_message("hidden diameter %.2f, noise %.2f smoothed by %.2f voxels to %.2f\n", noise.hidden_diameter_voxel,
                  noise.scan_sd, noise.smooth_voxel, noise.mapped_sd);
    assert_true(fabs(noise.hidden_diameter_voxel / 4.0 - 1.0) < 0.15 && noise.hidden_noise_share < 0.5);
    assert_true(noise.smooth_voxel > 0.5 && noise.mapped_sd < 0.5 * noise.scan_sd);
    volume_release(&v);
}

/* A given diameter is used as it is. */
static void test_given_diameter(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct reconstruct_option o;
    struct reconstruct_report r = {0};
    make_bundle(&v, 7.0, false);
    reconstruct_option_default(&o);
    o.fiber_diameter_voxel = 5.0;
    assert_int_equal(reconstruct_orientation(&v, &o, NULL, NULL, &d, &r, NULL), STATUS_OK);
    assert_true(r.fiber_diameter_voxel == 5.0 && isnan(r.other_diameter_voxel));
    assert_int_equal(o.h, 15);
    direction_volume_release(&d);
    o.fiber_diameter_voxel = 14.0; /* another one than the scan's, which is stated */
    o.h = 0;
    assert_int_equal(reconstruct_orientation(&v, &o, NULL, NULL, &d, &r, NULL), STATUS_OK);
    print_message("given 14.0, the scan shows %.2f\n", r.other_diameter_voxel);
    assert_true(r.fiber_diameter_voxel == 14.0 && fabs(r.other_diameter_voxel / 7.0 - 1.0) < 0.15);
    volume_release(&v);
    direction_volume_release(&d);
}

/* Fibers that noise hid in the scan are preferred to the yarns that are left of them once it is smoothed. */
static void test_hidden_diameter(void **state)
{
    (void)state;
    struct volume v;
    struct direction_volume d;
    struct reconstruct_option o;
    struct reconstruct_report r = {.noise = {.hidden_diameter_voxel = 5.0, .hidden_noise_share = 0.4}};
    make_bundle(&v, 12.0, false);
    reconstruct_option_default(&o);
    assert_int_equal(reconstruct_orientation(&v, &o, NULL, NULL, &d, &r, NULL), STATUS_OK);
    assert_true(r.fiber_diameter_voxel == 5.0 && r.diameter_noise_share == 0.4);
    assert_true(fabs(r.other_diameter_voxel / 12.0 - 1.0) < 0.1);
    volume_release(&v);
    direction_volume_release(&d);
}

static void keep_warning(void *context, const char *option, const char *text)
{
    if (strcmp(option, OPTION_FIBER_DIAMETER) == 0) snprintf(context, 600, "%s", text);
}

/* The user reads which diameter was chosen over which, and why. */
static void test_diameter_warning(void **state)
{
    (void)state;
    char text[600] = "";
    float radius_m[5] = {7e-6f, 7e-6f, 7e-6f, 7e-6f, 7e-6f};
    const struct fiber_set f = {.n_fiber = 5, .radius_m = radius_m};
    const struct warning_sink sink = {keep_warning, text};
    struct reconstruct_report r = {.fiber_diameter_voxel = 7.0, .diameter_noise_share = 0.1};
    r.other_diameter_voxel = NAN;
    reconstruct_warn_fibers(&r, &f, &sink);
    assert_string_equal(text, "");
    r.other_diameter_voxel = 3.0;
    r.other_diameter_noise_share = 0.67;
    reconstruct_warn_fibers(&r, &f, &sink);
    assert_non_null(strstr(text, "7.0 voxels was chosen over one of 3.0, because 67 %"));
    r.other_diameter_voxel = 20.0;
    reconstruct_warn_fibers(&r, &f, &sink);
    assert_non_null(strstr(text, "7.0 voxels was chosen over one of 20.0, which responds more strongly"));
    r.diameter_noise_share = NAN; /* given */
    reconstruct_warn_fibers(&r, &f, &sink);
    assert_non_null(strstr(text, "that was given, 7.0 voxels, was taken over one of 20.0 voxels that the scan shows"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_diameter_in_strong_noise),
        cmocka_unit_test(test_diameter_in_correlated_noise),
        cmocka_unit_test(test_diameter_below_that_of_yarns),
        cmocka_unit_test(test_shoulder_of_yarns),
        cmocka_unit_test(test_hidden_fibers_are_smoothed),
        cmocka_unit_test(test_given_diameter),
        cmocka_unit_test(test_hidden_diameter),
        cmocka_unit_test(test_diameter_warning),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
