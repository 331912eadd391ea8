/* What a scan can give, predicted from the scan alone: the phantom of a trial has the radii and sections that were
 * measured, and its figures are those of the reconstruction itself, whose truth is known here. */
#include "tests/support/agreement.h"
#include "tests/support/scan/phantom_reconstruction.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_FIBER = 24 };
static const double SNR = 5.0;

/* A small felt of fibers of 7 voxels, its scan in correlated noise, and the reconstruction of that. */
static void reconstruct_felt(const struct phantom_section_law *law, double radius_spread,
                             struct phantom_reconstruction *r)
{
    struct error err = {0};
    struct phantom_option o;
    struct phantom_scan_option scan;
    phantom_option_default(&o, PHANTOM_FELT);
    o.n_fiber_per_yarn = N_FIBER;
    o.felt_tile_m *= 0.65;
    o.radius_spread = radius_spread;
    o.section = *law;
    phantom_scan_option_default(&scan);
    scan.snr = SNR;
    scan.noise_sd_voxel = 0.5;
    *r = (struct phantom_reconstruction){0};
    reconstruct_option_default(&r->option);
    if (phantom_reconstruct_scan(&o, &scan, r, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static void try_scan(struct phantom_reconstruction *r)
{
    struct error err = {0};
    struct reconstruct_option asked;
    struct thread_pool *pool;
    reconstruct_option_default(&asked);
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    if (reconstruct_trial(&r->v, &r->found, &asked, pool, NULL, &r->report, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    thread_pool_free(pool);
    const struct scan_trial *t = &r->report.trial;
    assert_true(t->made);
    print_message("phantom of %zu fibers: signal-to-noise %.2f, radius spread %.3f, ratio %.3f +- %.3f, lumen %.3f +- "
                  "%.3f; lumens found again to %.3f\n",
                  t->n_true, t->snr, t->radius_spread, t->axis_ratio, t->axis_ratio_spread, t->lumen, t->lumen_spread,
                  t->lumen_rms);
}

/* The prediction agrees within three standard errors of both. Recall besides by an end of each piece in the phantom:
 * the tracer stops up to half a voxel before the face where the fiber's continuation is missing. */
static void expect_prediction(const struct phantom_reconstruction *r)
{
    const struct scan_trial *t = &r->report.trial;
    const struct compare_report *c = &r->compare;
    const double ends = (double)(2 * t->n_true) * 0.5 * r->v.voxel_size_m[0] / c->length_true_m;
    print_message("recall %.4f +- %.4f, predicted %.4f +- %.4f (ends %.4f); fragments %.3f +- %.3f, predicted %.3f +- "
                  "%.3f; axis RMS %.3f, predicted %.3f; radius RMS %.3f, predicted %.3f\n",
                  c->center_recall, c->center_recall_se, t->recall, t->recall_se, ends, c->fragments_per_fiber,
                  c->fragments_se, t->fragments, t->fragments_se, c->centerline_rms_voxel, t->axis_rms_voxel,
                  0.01 * c->radius_rms_percent, t->radius_rms);
    assert_true(fabs(t->recall - c->center_recall) <= 3.0 * hypot(t->recall_se, c->center_recall_se) + ends);
    assert_true(fabs(t->fragments - c->fragments_per_fiber) <= 3.0 * hypot(t->fragments_se, c->fragments_se));
}

/* Mean and standard deviation of the true lumens over the length. */
static void true_lumens(const struct fiber_set *f, double *mean, double *sd)
{
    double sum = 0.0, square = 0.0;
    for (size_t k = 0; k < f->n_vertex; k++) {
        sum += (double)f->shape[k].lumen;
        square += (double)f->shape[k].lumen * (double)f->shape[k].lumen;
    }
    *mean = sum / (double)f->n_vertex;
    *sd = sqrt(square / (double)f->n_vertex - *mean * *mean);
}

/* Every fiber has its own lumen and radius. */
static void test_a_hollow_scan(void **state)
{
    (void)state;
    const struct phantom_section_law law = {.seed = 1, .lumen = 0.6, .lumen_spread = 1.0};
    struct phantom_reconstruction r;
    double mean, sd;
    reconstruct_felt(&law, 0.2, &r);
    try_scan(&r);
    const struct scan_trial *t = &r.report.trial;
    true_lumens(&r.truth, &mean, &sd);
    print_message("true lumens %.3f +- %.3f\n", mean, sd);
    assert_true(r.report.lumens_measured && t->axis_ratio == 1.0);
    /* the error that all lumens share is stated with each */
    assert_true(fabs(t->lumen - mean) <= 3.0 * (double)r.found.shape[0].lumen_se);
    assert_true(fabs(t->lumen_spread - sd) <= 3.0 * sd / sqrt(2.0 * N_FIBER));
    assert_true(fabs(t->radius_spread - 0.2) <= 3.0 * 0.2 / sqrt(2.0 * N_FIBER));
    /* the scan was smoothed; the noise of either scan is known to a percent, the densest walls to a few */
    const double snr = SNR * r.report.noise.scan_sd / r.report.noise.mapped_sd;
    assert_true(fabs(t->snr / snr - 1.0) < 0.05);
    assert_true(t->lumen_rms < 0.1);
    expect_prediction(&r);
    phantom_reconstruction_release(&r);
}

/* Flat fibers have a phantom of their ratios. */
static void test_a_flat_scan(void **state)
{
    (void)state;
    if (!is_long_variant()) return; /* make test-long; test_a_hollow_scan has measured sections, too */
    const struct phantom_section_law law = {.seed = 1, .aspect = 2.5, .turns_per_m = 1e3};
    struct phantom_reconstruction r;
    reconstruct_felt(&law, 0.0, &r);
    try_scan(&r);
    const struct scan_trial *t = &r.report.trial;
    const double sd = 1.5 / sqrt(12.0); /* of ratios even between 1 and 2.5 */
    assert_true(fabs(t->axis_ratio - 1.75) <= 3.0 * sd / sqrt((double)N_FIBER));
    assert_true(t->axis_ratio_spread > 0.5 * sd && t->axis_ratio_spread < 1.5 * sd);
    assert_true(t->lumen == 0.0 && isnan(t->lumen_rms));
    expect_prediction(&r);
    phantom_reconstruction_release(&r);
}

/* Round solid fibers that are alike: measured sections, which are noise, change nothing. */
static void test_a_solid_scan(void **state)
{
    (void)state;
    const struct phantom_section_law law = {0};
    struct phantom_reconstruction r;
    reconstruct_felt(&law, 0.0, &r);
    try_scan(&r);
    const struct scan_trial first = r.report.trial;
    assert_true(first.axis_ratio == 1.0 && first.lumen == 0.0 && r.report.axis_ratio > 1.0);
    expect_prediction(&r);
    free(r.found.shape);
    r.found.shape = NULL;
    try_scan(&r);
    assert_true(r.report.trial.recall == first.recall && r.report.trial.axis_rms_voxel == first.axis_rms_voxel);
    assert_true(r.report.trial.fragments == first.fragments && r.report.trial.radius_rms == first.radius_rms);
    phantom_reconstruction_release(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_hollow_scan),
        cmocka_unit_test(test_a_flat_scan),
        cmocka_unit_test(test_a_solid_scan),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
