/* Fibers of phantoms: tiles have no seams, and fibers neither penetrate each other nor bend until they break. */
#include "base/angle.h"
#include "geometry/phantom/phantom.h"
#include "tests/support/cloth/make_phantom.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_every_weave_is_a_valid_tile(void **state)
{
    (void)state;
    for (int w = 0; w < PHANTOM_WEAVE_COUNT; w++) {
        struct phantom_option o;
        struct phantom_report r;
        struct fiber_set f;
        double low, high;
        enum phantom_weave found;
        assert_int_equal(phantom_weave_find(phantom_weave_name((enum phantom_weave)w), &found, NULL), STATUS_OK);
        assert_int_equal(found, w);
        phantom_option_default(&o, (enum phantom_weave)w);
        o.n_relax = 50; /* fewer than for a good phantom, to save time */
        make_phantom(&o, 2, &f, &r);
        assert_int_equal(fiber_set_validate(&f, NULL), STATUS_OK);
        fiber_set_z_range_m(&f, &low, &high);
        assert_true(fabs(low - 4.0 * o.voxel_size_m) < 0.5 * o.voxel_size_m);
        for (int a = 0; a < 2; a++)
            assert_true(fabs((double)r.n_voxel[a] * o.voxel_size_m / f.tile_size_m[a] - 1.0) < 1e-9);
        assert_true((double)r.n_voxel[2] * o.voxel_size_m >= high + 3.9 * o.voxel_size_m);
        assert_true(r.overlap_mean < 0.03 && r.overlap_max < 0.35);
        assert_true(r.volume_fraction > 0.2 && r.volume_fraction < 0.8);
        assert_true(r.cover > 0.8);
        for (size_t i = 0; i < f.n_fiber; i++) /* smooth: vertices 1.5 voxels apart, hardly more */
            for (size_t k = f.first_vertex[i]; k + 1 < f.first_vertex[i + 1]; k++) {
                const float *p = f.position_m + 3 * k;
                double step =
                    sqrt(pow((double)(p[3] - p[0]), 2) + pow((double)(p[4] - p[1]), 2) + pow((double)(p[5] - p[2]), 2));
                assert_true(step < 2.5 * o.voxel_size_m);
            }
        fiber_set_release(&f);
    }
}

static void test_same_fibers_for_any_number_of_threads(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f[3];
    phantom_option_default(&o, PHANTOM_PLAIN);
    o.n_flyaway_per_yarn = 2;
    o.n_relax = 30;
    for (size_t i = 0; i < 3; i++) make_phantom(&o, i, &f[i], &r);
    for (size_t i = 1; i < 3; i++) {
        assert_int_equal(f[i].n_vertex, f[0].n_vertex);
        assert_memory_equal(f[i].position_m, f[0].position_m, 3 * f[0].n_vertex * sizeof(float));
    }
    o.seed = 2;
    fiber_set_release(&f[2]);
    make_phantom(&o, 1, &f[2], &r);
    assert_memory_not_equal(f[2].position_m, f[0].position_m, 30 * sizeof(float));
    for (size_t i = 0; i < 3; i++) fiber_set_release(&f[i]);
}

/* If fibers were only pushed apart, there would be kinks with strains of 0.51 in the plain weave, 0.46 in the velvet
 * and 0.34 in the felt, at which fibers break. */
static void test_no_fiber_is_bent_until_it_breaks(void **state)
{
    (void)state;
    static const struct {
        enum phantom_weave weave;
        double strain;
    } want[] = {{PHANTOM_PLAIN, 0.38}, {PHANTOM_VELVET, 0.33}, {PHANTOM_FELT, 0.28}};
    for (size_t i = 0; i < sizeof want / sizeof *want; i++) {
        struct phantom_option o;
        struct phantom_report r;
        struct fiber_set f;
        phantom_option_default(&o, want[i].weave);
        make_phantom(&o, 2, &f, &r);
        print_message("%s: strain %.3f, overlap %.4f, at most %.3f\n", phantom_weave_name(want[i].weave), r.strain_p95,
                      r.overlap_mean, r.overlap_max);
        assert_true(r.strain_p95 < want[i].strain);
        assert_true(r.overlap_mean < 0.01 && r.overlap_max < 0.1);
        fiber_set_release(&f);
    }
}

/* Distance of two points in the two coordinates other than `along`, with the period of the tile. */
static double apart(const struct fiber_set *f, const float *a, const float *b, size_t along)
{
    size_t across = 1 - along;
    double d = (double)a[across] - (double)b[across], tile = f->tile_size_m[across];
    return hypot(d - tile * round(d / tile), (double)a[2] - (double)b[2]);
}

/* Every fiber of a twill runs from face to face and continues as exactly one fiber at the opposite face. */
static void test_twill_has_no_seam(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    make_phantom(&o, 1, &f, &r);
    assert_int_equal(f.n_fiber, 8 * 19);
    assert_true(r.overlap_mean < 0.003 && r.overlap_max < 0.05);
    assert_true(r.cover > 0.99);
    for (size_t i = 0; i < f.n_fiber; i++) {
        size_t along = f.axis_class[i], n_next = 0;
        const float *first = f.position_m + 3 * f.first_vertex[i],
                    *last = f.position_m + 3 * (f.first_vertex[i + 1] - 1);
        assert_true(fabs((double)first[along]) < 1e-9);
        assert_true(fabs((double)last[along] - f.tile_size_m[along]) < 1e-9);
        for (size_t j = 0; j < f.n_fiber; j++)
            if (f.axis_class[j] == along && apart(&f, last, f.position_m + 3 * f.first_vertex[j], along) < 1e-9) {
                const float *next = f.position_m + 3 * f.first_vertex[j];
                double cosine = 0, a2 = 0, b2 = 0; /* and in the same direction */
                for (int k = 0; k < 3; k++) {
                    double a = (double)last[k] - (double)last[k - 3], b = (double)next[k + 3] - (double)next[k];
                    cosine += a * b;
                    a2 += a * a;
                    b2 += b * b;
                }
                assert_true(cosine / sqrt(a2 * b2) > cos(5.0 * RAD_PER_DEG));
                n_next++;
            }
        assert_int_equal(n_next, 1);
    }
    fiber_set_release(&f);
}

static void test_wrong_options_are_named(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    struct error err;
    enum phantom_weave w;
    fiber_set_init(&f);
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.n_yarn[0] = 3;
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, "n_yarn");
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.packing = (double)NAN;
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &r, &err), STATUS_INVALID);
    assert_string_equal(err.field, "packing");
    assert_int_equal(phantom_weave_find("tweed", &w, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "'tweed'"));
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_weave_is_a_valid_tile),
        cmocka_unit_test(test_same_fibers_for_any_number_of_threads),
        cmocka_unit_test(test_no_fiber_is_bent_until_it_breaks),
        cmocka_unit_test(test_twill_has_no_seam),
        cmocka_unit_test(test_wrong_options_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
