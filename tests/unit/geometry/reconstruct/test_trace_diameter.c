/* The fiber diameter without the blur of the scan: known answers. */
#include "geometry/diameter/fiber_diameter.h"
#include "geometry/diameter/scale_space.h"
#include "geometry/filter/filter_choice.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/reconstruct/trace_box.h"
#include "geometry/reconstruct/trace_diameter.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const double voxel_m[3] = {2e-6, 2e-6, 2e-6};

enum { N_SIDE = 64, N_ROW = 5 /* odd */, N_BUNDLE = N_ROW * N_ROW };

/* A bundle of parallel fibers in a cube, whose scan is blurred (standard deviation in voxels). The diameter of every
 * second one is smaller by a share, and that of the others larger. */
static void make_bundle(struct volume *v, double diameter, double share, double blur)
{
    const size_t n[3] = {N_SIDE, N_SIDE, N_SIDE};
    struct test_cylinder c[N_BUNDLE];
    float *scratch = malloc(volume_n_voxel(n) * sizeof *scratch);
    assert_non_null(scratch);
    for (int i = 0; i < N_BUNDLE; i++) {
        const double y = 32.0 + 1.1 * diameter * (i % N_ROW - 2), z = 32.0 + 1.1 * diameter * (i / N_ROW - 2);
        const double radius = 0.5 * diameter * (i % 2 == 0 ? 1.0 + share : 1.0 - share);
        c[i] = (struct test_cylinder){{32.0, y, z}, {1.0, 0.1, 0.05}, radius};
    }
    assert_int_equal(volume_init(v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(v, c, N_BUNDLE, 0.02, 7);
    scale_blur(v->density, scratch, n, blur);
    for (size_t i = 0; i < volume_n_voxel(n); i++) v->density[i] = fminf(1.0f, fmaxf(0.0f, v->density[i]));
    free(scratch);
}

/* The scale of the strongest response is off by blur and by thick fibers, and the diameter of the lines is not. */
static void test_blur_is_taken_out(void **state)
{
    (void)state;
    static const struct {
        double diameter, share, blur;
    } scan[] = {{7.0, 0.25, 1.0}, {4.5, 0.25, 0.7}};
    for (size_t k = 0; k < sizeof scan / sizeof *scan; k++) {
        struct volume v;
        struct direction_volume d;
        struct reconstruct_option o;
        struct reconstruct_report r = {0};
        struct fiber_diameter peak;
        make_bundle(&v, scan[k].diameter, scan[k].share, scan[k].blur);
        reconstruct_option_default(&o);
        assert_int_equal(fiber_diameter_measure(&v, NULL, NULL, &peak, NULL), STATUS_OK);
        assert_int_equal(reconstruct_orientation(&v, &o, NULL, NULL, &d, &r, NULL), STATUS_OK);
        print_message("diameter %g, blur %g: peak %.2f, lines %.2f\n", scan[k].diameter, scan[k].blur, peak.voxel,
                      r.fiber_diameter_voxel);
        assert_true(fabs(peak.voxel / scan[k].diameter - 1.0) > 0.2);
        assert_true(fabs(r.fiber_diameter_voxel / scan[k].diameter - 1.0) < 0.04);
        direction_volume_release(&d);
        volume_release(&v);
    }
}

/* Where lines tell nothing of the fibers the diameter of the peak stays: too far from it, or no lines at all. */
static void test_peak_stays(void **state)
{
    (void)state;
    struct volume v;
    struct reconstruct_report r = {.fiber_diameter_voxel = 14.0};
    struct reconstruct_option o;
    reconstruct_option_default(&o);
    make_bundle(&v, 7.0, 0.0, 0.5);
    assert_int_equal(trace_diameter(&v, &v, reconstruct_orientation_again, &o, NULL, NULL, &r, NULL), STATUS_OK);
    assert_true(r.fiber_diameter_voxel == 14.0);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) v.density[i] = 0.0f;
    r.fiber_diameter_voxel = 7.0;
    assert_int_equal(trace_diameter(&v, &v, reconstruct_orientation_again, &o, NULL, NULL, &r, NULL), STATUS_OK);
    assert_true(r.fiber_diameter_voxel == 7.0);
    volume_release(&v);
}

/* The box lies in the known part of the volume, though the continued densities beyond it are denser. */
static void test_box_is_known(void **state)
{
    (void)state;
    const size_t n[3] = {N_SIDE, N_SIDE, 4 * N_SIDE};
    struct volume part, v, known;
    struct reconstruct_report r = {.fiber_diameter_voxel = 7.0};
    struct reconstruct_option o;
    reconstruct_option_default(&o);
    make_bundle(&part, 6.4, 0.0, 0.5);
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    assert_int_equal(volume_init(&known, n, voxel_m, NULL), STATUS_OK);
    const size_t size = volume_n_voxel(part.n);
    for (size_t i = 0; i < volume_n_voxel(n); i++) {
        if (i < size) v.density[i] = known.density[i] = part.density[i];
        if (i >= 2 * size) v.density[i] = 1.0f;
    }
    assert_int_equal(trace_diameter(&v, &known, reconstruct_orientation_again, &o, NULL, NULL, &r, NULL), STATUS_OK);
    print_message("diameter 6.4: %.2f\n", r.fiber_diameter_voxel);
    assert_true(fabs(r.fiber_diameter_voxel / 6.4 - 1.0) < 0.04);
    volume_release(&part);
    volume_release(&known);
    volume_release(&v);
}

/* Where thin fibers and thick ones, in each of which several thin lines would fit, lie in one scan, a diameter between
 * both is taken. */
static void test_two_diameters_meet_between(void **state)
{
    (void)state;
    enum { N_THICK = 3, N_THIN = 10 };
    const size_t n[3] = {N_SIDE, N_SIDE, N_SIDE};
    struct test_cylinder c[N_THICK + N_THIN];
    struct volume v;
    struct reconstruct_report r = {.fiber_diameter_voxel = 5.0};
    struct reconstruct_option o;
    reconstruct_option_default(&o);
    for (int i = 0; i < N_THICK; i++)
        c[i] = (struct test_cylinder){{32.0, 12.0 + 19.0 * i, 14.0}, {1.0, 0.1, 0.05}, 6.0};
    for (int i = 0; i < N_THIN; i++)
        c[N_THICK + i] =
            (struct test_cylinder){{7.0 + 10.5 * (i % 5), 32.0, 32.0 + 14.0 * (i / 5)}, {0.1, 1.0, 0.05}, 2.2};
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    test_fill_cylinders(&v, c, N_THICK + N_THIN, 0.1, 7);
    for (size_t i = 0; i < volume_n_voxel(n); i++) v.density[i] = fminf(1.0f, fmaxf(0.0f, v.density[i]));
    assert_int_equal(trace_diameter(&v, &v, reconstruct_orientation, &o, NULL, NULL, &r, NULL), STATUS_OK);
    print_message("diameters 4.4 and 12: from 5 to %.2f\n", r.fiber_diameter_voxel);
    assert_true(fabs(r.fiber_diameter_voxel - 7.0) < 1e-9);
    volume_release(&v);
}

/* Where the peak is of thick fibers, as wide as a yarn of thin ones, a diameter between both is taken. Without a yarn
 * the same thick fibers have their own diameter. */
static void test_a_yarn_is_no_thick_fiber(void **state)
{
    (void)state;
    enum { N_THICK = 3, N_THIN = 14 };
    const size_t n[3] = {N_SIDE, N_SIDE, N_SIDE};
    struct test_cylinder c[N_THICK + N_THIN];
    for (int i = 0; i < N_THICK; i++)
        c[i] = (struct test_cylinder){{32.0, 12.0 + 19.0 * i, 14.0}, {1.0, 0.1, 0.05}, 6.0};
    for (int i = 0; i < N_THIN; i++) {
        const double away = i % 7 == 0 ? 0.0 : 4.4, angle = M_PI / 3.0 * i;
        c[N_THICK + i] = (struct test_cylinder){
            {17.0 + 30.0 * (i / 7) + away * cos(angle), 32.0, 42.0 + away * sin(angle)}, {0.0, 1.0, 0.0}, 2.0};
    }
    for (int k = 0; k < 2; k++) {
        struct volume v;
        struct reconstruct_report r = {.fiber_diameter_voxel = 12.0};
        struct reconstruct_option o;
        reconstruct_option_default(&o);
        assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
        test_fill_cylinders(&v, c, k == 0 ? N_THICK + N_THIN : N_THICK, 0.1, 7);
        for (size_t i = 0; i < volume_n_voxel(n); i++) v.density[i] = fminf(1.0f, fmaxf(0.0f, v.density[i]));
        assert_int_equal(trace_diameter(&v, &v, reconstruct_orientation_again, &o, NULL, NULL, &r, NULL), STATUS_OK);
        print_message("diameters 12 and %d: from 12 to %.2f\n", k == 0 ? 4 : 12, r.fiber_diameter_voxel);
        assert_true(fabs(r.fiber_diameter_voxel - (k == 0 ? 7.5 : 12.0)) < 0.5);
        volume_release(&v);
    }
}

/* A strongly blurred scan keeps its peak and gets a narrower filter, but not one that is noisy too. */
static void test_blurred_filter_is_narrow(void **state)
{
    (void)state;
    const double noise[2] = {0.1, 0.4};
    struct volume v;
    make_bundle(&v, 7.0, 0.0, 1.6);
    for (int k = 0; k < 2; k++) {
        struct reconstruct_report r = {.fiber_diameter_voxel = 7.0, .noise.scan_sd = noise[k]};
        struct reconstruct_option o, usual, narrow;
        reconstruct_option_default(&o);
        usual = narrow = o;
        filter_choose(&usual, &v, 7.0);
        filter_choose_blurred(&narrow, 7.0);
        assert_true(narrow.s > 1.5 * usual.s && narrow.h < usual.h);
        assert_int_equal(trace_diameter(&v, &v, reconstruct_orientation_again, &o, NULL, NULL, &r, NULL), STATUS_OK);
        assert_true(r.fiber_diameter_voxel == 7.0);
        assert_true(k == 0 ? o.s == narrow.s && o.h == narrow.h : isnan(o.s) && o.h == 0);
    }
    volume_release(&v);
}

/* The first box of a scan is its fullest. A large scan has other ones, with at least half as much material. */
static void test_boxes(void **state)
{
    (void)state;
    enum { N = 192, N_BOX = 48 };
    struct volume v, box = {0};
    size_t from[3];
    assert_int_equal(volume_init(&v, (const size_t[3]){N, N, N}, voxel_m, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(v.n); i++) {
        const size_t z = i / (N * N);
        v.density[i] = z < N / 2 ? 0.1f : z < 3 * N / 4 ? 0.3f : 0.4f;
    }
    assert_int_equal(trace_box_copy(&v, &v, 4.0, 0, &box, from, NULL), STATUS_OK);
    assert_int_equal(from[2], N - N_BOX);
    volume_release(&box);
    for (int i = 1; i < TRACE_N_BOX; i++) {
        assert_int_equal(trace_box_copy(&v, &v, 4.0, i, &box, from, NULL), STATUS_OK);
        assert_int_equal(box.n[0], N_BOX);
        assert_true(from[2] >= N / 2 && box.density[0] >= 0.3f);
        volume_release(&box);
    }
    volume_crop(&v, (const size_t[6]){0, 0, 0, 96, 96, 96}); /* eight boxes: one of them says enough */
    box = (struct volume){0};
    assert_int_equal(trace_box_copy(&v, &v, 4.0, 1, &box, from, NULL), STATUS_OK);
    assert_int_equal(box.n[0], 0);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blur_is_taken_out),
        cmocka_unit_test(test_peak_stays),
        cmocka_unit_test(test_box_is_known),
        cmocka_unit_test(test_two_diameters_meet_between),
        cmocka_unit_test(test_a_yarn_is_no_thick_fiber),
        cmocka_unit_test(test_blurred_filter_is_narrow),
        cmocka_unit_test(test_boxes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
