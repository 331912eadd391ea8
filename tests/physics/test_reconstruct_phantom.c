/* Reconstruction of phantoms measured against the truth: fiber diameter 7 voxels, blur 0.7 voxels, signal-to-noise 5. */
#include "geometry/phantom/compare.h"
#include "geometry/phantom/phantom.h"
#include "geometry/reconstruct.h"
#include "geometry/volume/density_map.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void reconstruct_phantom(enum phantom_weave weave, struct compare_report *c)
{
    struct error err = {0};
    struct thread_pool *pool;
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_report report;
    struct reconstruct_option option;
    struct reconstruct_report r = {0};
    struct fiber_set truth, found;
    struct volume v;
    struct direction_volume d;
    struct density_modes m;
    fiber_set_init(&truth);
    phantom_option_default(&o, weave);
    phantom_scan_option_default(&scan);
    reconstruct_option_default(&option);
    scan.voxel_size_m = o.voxel_size_m;
    scan.snr = 5.0;
    assert_int_equal(thread_pool_new(0, &pool, &err), STATUS_OK);
    assert_int_equal(phantom_generate(&o, pool, NULL, &truth, &report, &err), STATUS_OK);
    assert_int_equal(phantom_scan(&truth, report.n_voxel, &scan, pool, NULL, &v, &err), STATUS_OK);
    assert_int_equal(density_modes_find(&v, &m, &err), STATUS_OK);
    assert_int_equal(density_map_apply(&v, m.low, m.high, pool, &err), STATUS_OK);
    assert_int_equal(reconstruct_orientation(&v, &option, pool, NULL, &d, &r, &err), STATUS_OK);
    assert_int_equal(reconstruct_fibers(&v, &d, &option, pool, NULL, &found, &r, &err), STATUS_OK);
    const struct compare_option co = {.voxel_size_m = o.voxel_size_m};
    assert_int_equal(compare_fibers(&truth, &found, &co, c, &err), STATUS_OK);
    print_message("%s, diameter %.1f voxels, signal-to-noise 5: %zu fibers found, %zu true; precision %.3f recall %.3f rms %.2f voxel "
                  "length recovered %.3f (found/true %.3f) fragments %.2f merges %.3f direction %.1f deg (95 %%: %.1f) radius %+.1f %%\n",
                  phantom_weave_name(weave), c->fiber_diameter_voxel, c->n_found, c->n_true, c->center_precision, c->center_recall,
                  c->centerline_rms_voxel, c->length_recovered, c->length_found_m / c->length_true_m, c->fragments_per_fiber,
                  c->merges_per_fiber, c->direction_mean_deg, c->direction_p95_deg, c->radius_bias_percent);
    volume_release(&v);
    direction_volume_release(&d);
    fiber_set_release(&truth);
    fiber_set_release(&found);
    thread_pool_free(pool);
}

static void test_twill(void **state)
{
    (void)state;
    struct compare_report c;
    reconstruct_phantom(PHANTOM_TWILL_2_2, &c);
    assert_true(c.center_precision >= 0.97);
    assert_true(c.center_recall >= 0.95);
    assert_true(c.length_recovered >= 0.95);
    assert_true(fabs(c.length_found_m / c.length_true_m - 1.0) < 0.03);
    assert_true(c.centerline_rms_voxel <= 0.5);
    assert_true(c.direction_mean_deg <= 4.0);
    assert_true(fabs(c.radius_bias_percent) <= 3.0);
}

static void test_knit(void **state)
{
    (void)state;
    struct compare_report c;
    reconstruct_phantom(PHANTOM_KNIT, &c);
    assert_true(c.center_precision >= 0.97);
    assert_true(c.center_recall >= 0.95);
    assert_true(c.length_recovered >= 0.95);
    assert_true(c.centerline_rms_voxel <= 0.35);
    assert_true(c.direction_mean_deg <= 3.0);
    assert_true(fabs(c.radius_bias_percent) <= 3.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_twill), cmocka_unit_test(test_knit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
