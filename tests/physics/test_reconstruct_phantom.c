/* Reconstruction of phantoms measured against the truth: fiber diameter 7 voxels, blur 0.7 voxels, signal-to-noise
 * 5; fibers that are alike in white noise, and fibers whose radii spread by 20 % in correlated noise. */
#include "tests/support/agreement.h"
#include "tests/support/scan/phantom_reconstruction.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The direction volume of the result is that of the true fibers, inside of them and in the rim that they give their
 * direction to. The filter alone is worse, most of all in the rim. */
static void check_directions(const struct phantom_reconstruction *r)
{
    const struct direction_compare *a = &r->filtered, *b = &r->transferred;
    print_message(
        "directions of voxels, filtered and transferred: mean %.2f, %.2f, 95 %% %.1f, %.1f inside, mean %.2f, "
        "%.2f in the rim; %.3f kept\n",
        a->inside.mean_deg, b->inside.mean_deg, a->inside.p95_deg, b->inside.p95_deg, a->rim.mean_deg, b->rim.mean_deg,
        b->kept_share);
    assert_true(b->inside.mean_deg <= 4.0 && b->inside.p95_deg <= 12.0);
    assert_true(b->inside.mean_deg <= 0.75 * a->inside.mean_deg);
    assert_true(b->rim.n > b->inside.n / 50 && b->rim.mean_deg <= 6.0 && b->rim.mean_deg <= 0.6 * a->rim.mean_deg);
    assert_true(b->kept_share > 0.85);
}

static void reconstruct_phantom(enum phantom_weave weave, struct compare_report *c)
{
    struct error err = {0};
    struct phantom_option o;
    struct phantom_reconstruction r = {0};
    phantom_option_default(&o, weave);
    reconstruct_option_default(&r.option);
    assert_int_equal(phantom_reconstruct(&o, 5.0, &r, &err), STATUS_OK);
    *c = r.compare;
    print_message("%s, diameter %.1f voxels, signal-to-noise 5: %zu fibers found, %zu true; precision %.3f recall %.3f "
                  "rms %.2f voxel "
                  "length recovered %.3f (found/true %.3f) fragments %.2f merges %.3f direction %.1f deg (95 %%: %.1f) "
                  "radius %+.1f %%\n",
                  phantom_weave_name(weave), c->fiber_diameter_voxel, c->n_found, c->n_true, c->center_precision,
                  c->center_recall, c->centerline_rms_voxel, c->length_recovered, c->length_found_m / c->length_true_m,
                  c->fragments_per_fiber, c->merges_per_fiber, c->direction_mean_deg, c->direction_p95_deg,
                  c->radius_bias_percent);
    check_directions(&r);
    phantom_reconstruction_release(&r);
}

static void meet_the_goals(const struct compare_report *c)
{
    assert_true(c->center_precision >= 0.97);
    assert_true(c->center_recall >= 0.95);
    assert_true(c->length_recovered >= 0.95);
    assert_true(c->centerline_rms_voxel <= 0.35);
    assert_true(c->fragments_per_fiber <= 1.3);
    assert_true(c->merges_per_fiber <= 0.02);
    assert_true(c->direction_mean_deg <= 3.0);
    assert_true(c->direction_p95_deg <= 8.0);
    assert_true(fabs(c->radius_bias_percent) <= 3.0);
}

static void test_twill(void **state)
{
    (void)state;
    struct compare_report c;
    reconstruct_phantom(PHANTOM_TWILL_2_2, &c);
    meet_the_goals(&c);
    assert_true(fabs(c.length_found_m / c.length_true_m - 1.0) < 0.03);
}

static void test_knit(void **state)
{
    (void)state;
    if (!is_long_variant()) return; /* make test-long */
    struct compare_report c;
    reconstruct_phantom(PHANTOM_KNIT, &c);
    meet_the_goals(&c);
}

static void test_velvet(void **state)
{
    (void)state;
    if (!is_long_variant()) return; /* make test-long */
    struct compare_report c;
    reconstruct_phantom(PHANTOM_VELVET, &c);
    meet_the_goals(&c);
}

/* Fibers of unequal radius: each has its own radius in the result, and the axes are as good as those of equal
 * fibers. */
static void test_unequal_radii(void **state)
{
    (void)state;
    struct error err = {0};
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_reconstruction r = {0};
    phantom_option_default(&o, PHANTOM_FELT);
    o.radius_spread = 0.2;
    phantom_scan_option_default(&scan);
    scan.snr = 5.0;
    scan.noise_sd_voxel = 0.5;
    reconstruct_option_default(&r.option);
    assert_int_equal(phantom_reconstruct_scan(&o, &scan, &r, &err), STATUS_OK);
    const struct compare_report *c = &r.compare;
    print_message(
        "felt, radii spread by 20 %%: precision %.3f recall %.3f rms %.2f voxel fragments %.2f merges %.3f "
        "direction %.1f deg (95 %%: %.1f), radius of a fiber %.1f %% RMS, spread %.3f, standard error %.3f um\n",
        c->center_precision, c->center_recall, c->centerline_rms_voxel, c->fragments_per_fiber, c->merges_per_fiber,
        c->direction_mean_deg, c->direction_p95_deg, c->radius_rms_percent, r.report.radius_spread,
        1e6 * r.report.single_radius_se_m);
    assert_true(c->center_precision >= 0.97 && c->center_recall >= 0.95);
    assert_true(c->centerline_rms_voxel <= 0.25 && c->fragments_per_fiber <= 1.1 && c->merges_per_fiber <= 0.02);
    assert_true(c->direction_mean_deg <= 2.5 && c->direction_p95_deg <= 6.0);
    assert_true(c->radius_rms_percent <= 4.0);
    assert_true(fabs(r.report.radius_spread - 0.2) < 0.05 && r.report.single_radius_se_m > 0.0);
    double stated = 100.0 * r.report.single_radius_se_m / r.report.profile_radius_m;
    print_message("error of the radius of a fiber: stated %.2f %%, found %.2f %%\n", stated, c->radius_rms_percent);
    assert_true(stated > 0.33 * c->radius_rms_percent && stated < 3.0 * c->radius_rms_percent);
    phantom_reconstruction_release(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_twill), cmocka_unit_test(test_knit),
                                       cmocka_unit_test(test_velvet), cmocka_unit_test(test_unequal_radii)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
