/* Directions of the voxels of a velvet whose fibers are 4 voxels thick and touch each other. */
#include "geometry/grade/compare_directions.h"
#include "geometry/phantom/phantom.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/density_map.h"
#include "tests/support/scan/phantom_reconstruction.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* A filter as wide as the fiber takes a row of touching fibers for one, and crosses the fibers at the roots of the
 * pile: its directions are off by 21.0 degrees in the mean, those of the narrow one by 16.6. The bar is half way. */
static void test_touching_thin_fibers(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_report made;
    struct fiber_set truth;
    struct volume v;
    struct direction_volume d;
    struct density_modes m;
    struct reconstruct_option option;
    struct reconstruct_report r = {0};
    struct direction_compare c;
    phantom_cloth_of_diameter(&o, PHANTOM_VELVET, 4.0);
    o.n_yarn[0] = o.n_yarn[1] = 2;
    o.seed = 2;
    phantom_scan_option_default(&scan);
    scan.seed = 2;
    scan.snr = 5.0;
    scan.voxel_size_m = o.voxel_size_m;
    reconstruct_option_default(&option);
    fiber_set_init(&truth);
    assert_int_equal(phantom_generate(&o, NULL, NULL, &truth, &made, NULL), STATUS_OK);
    assert_int_equal(phantom_scan(&truth, made.n_voxel, &scan, NULL, NULL, &v, NULL), STATUS_OK);
    assert_int_equal(density_modes_find(&v, &m, NULL), STATUS_OK);
    assert_int_equal(scan_densities_map(&v, m.low, m.high, option.fiber_diameter_voxel, NULL, &r.noise, NULL),
                     STATUS_OK);
    assert_int_equal(reconstruct_orientation(&v, &option, NULL, NULL, &d, &r, NULL), STATUS_OK);
    assert_int_equal(compare_directions(&truth, &d, NULL, &c, NULL), STATUS_OK);
    print_message("diameter %.2f voxels: directions off by %.2f degrees in the mean inside of the fibers\n",
                  r.fiber_diameter_voxel, c.inside.mean_deg);
    assert_true(r.trace_edge_voxel < 1.0);
    assert_true(c.inside.mean_deg < 18.8);
    direction_volume_release(&d);
    volume_release(&v);
    fiber_set_release(&truth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_touching_thin_fibers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
