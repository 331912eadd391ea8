/* Lumens of hollow fibers are filled, and nothing outside of the fibers. */
#include "base/rng.h"
#include "geometry/diameter/along_smooth.h"
#include "geometry/diameter/fiber_diameter.h"
#include "geometry/diameter/lumen_evidence.h"
#include "geometry/diameter/lumen_fill.h"
#include "geometry/diameter/lumen_filter.h"
#include "geometry/volume/density_map.h"
#include "tests/support/scan/phantom_reconstruction.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

static const size_t n_voxel[3] = {72, 72, 72};
static const double voxel_m[3] = {2e-6, 2e-6, 2e-6}, radius = 3.5, tight = 7.1, noise_sd = 0.15;

/* Place of the middle of fiber i of a hexagonal bundle of 19 along x. */
static void middle_of(int i, double pitch, double *y, double *z)
{
    static const int per_row[5] = {3, 4, 5, 4, 3};
    int row = 0;
    for (; i >= per_row[row]; row++) i -= per_row[row];
    *y = 36.3 + pitch * (i - 0.5 * (per_row[row] - 1));
    *z = 36.1 + pitch * sqrt(0.75) * (row - 2);
}

/* Density at a distance from the middle of a fiber with a lumen, blurred by 0.7 voxels. */
static double profile_of(double distance, double outer, double lumen)
{
    const double blur = 0.7 * M_SQRT2;
    double hole = lumen > 0.0 ? 0.5 * erfc((distance - lumen) / blur) : 0.0;
    return 0.5 * erfc((distance - outer) / blur) - hole;
}

static double profile(double distance, double lumen) { return profile_of(distance, radius, lumen); }

/* 19 fibers of radius `outer`. */
static void make_bundle_of(double outer, double lumen, double pitch, double sd, struct volume *v)
{
    const struct rng_key key = {.seed = 5};
    struct rng r;
    assert_int_equal(volume_init(v, n_voxel, voxel_m, NULL), STATUS_OK);
    rng_start(&r, &key, 0, 0);
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++) {
        double sum = 0.0, z[2];
        for (int i = 0; i < 19; i++) {
            double cy, cz;
            middle_of(i, pitch, &cy, &cz);
            sum +=
                profile_of(hypot((double)(at / 72 % 72) + 0.5 - cy, (double)(at / (72 * 72)) + 0.5 - cz), outer, lumen);
        }
        rng_normal_pair(&r, z);
        v->density[at] = (float)fmin(1.0, fmax(0.0, fmin(1.0, sum) + sd * z[0]));
    }
}

static void make_bundle(double lumen, double pitch, struct volume *v)
{
    make_bundle_of(radius, lumen, pitch, noise_sd, v);
}

/* Mean density within `reach` of the middles of fibers. */
static double middle_density(const struct volume *v, double pitch, double reach)
{
    double sum = 0.0, n = 0.0;
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++)
        for (int i = 0; i < 19; i++) {
            double cy, cz;
            middle_of(i, pitch, &cy, &cz);
            if (hypot((double)(at / 72 % 72) + 0.5 - cy, (double)(at / (72 * 72)) + 0.5 - cz) > reach) continue;
            sum += (double)v->density[at];
            n += 1.0;
        }
    return sum / n;
}

/* What was filled is not lost. */
static void volume_restores(const struct volume *v, const struct volume *before)
{
    struct volume unfilled;
    assert_true(v->filled.n > 0);
    assert_int_equal(volume_copy_unfilled(v, &unfilled, NULL), STATUS_OK);
    assert_memory_equal(unfilled.density, before->density, volume_n_voxel(n_voxel) * sizeof *v->density);
    volume_release(&unfilled);
}

static void test_lumens_are_filled(void **state)
{
    (void)state;
    struct volume v, before;
    double share;
    make_bundle(0.45 * radius, tight, &v);
    make_bundle(0.45 * radius, tight, &before);
    double hollow = middle_density(&v, tight, 1.2);
    assert_int_equal(lumens_fill(&v, noise_sd, NULL, &share, NULL), STATUS_OK);
    print_message("density of the middles %.3f, before %.3f; filled %.3f\n", middle_density(&v, tight, 1.2), hollow,
                  share);
    assert_true(hollow < 0.5 && middle_density(&v, tight, 1.2) > 0.95);
    assert_true(share > 0.15); /* lumens alone: 0.45^2 / (1 - 0.45^2) = 0.25, and less by the blur */
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++) { /* what is not filled stays, and so does the outside */
        assert_true(v.density[at] == before.density[at] || v.density[at] == 1.0f);
        if (hypot((double)(at / 72 % 72) - 36.0, (double)(at / (72 * 72)) - 36.0) > 24.0)
            assert_true(v.density[at] == before.density[at]);
    }
    volume_restores(&v, &before);
    volume_release(&v);
    volume_release(&before);
}

/* Solid fibers apart from each other enclose nothing; void stays empty. */
static void test_nothing_is_enclosed(void **state)
{
    (void)state;
    struct volume v;
    double share;
    assert_int_equal(volume_init(&v, n_voxel, voxel_m, NULL), STATUS_OK);
    assert_int_equal(lumens_fill(&v, NAN, NULL, &share, NULL), STATUS_OK);
    assert_true(share == 0.0);
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++)
        v.density[at] = (float)profile(hypot((double)(at / 72 % 72) - 30.0, (double)(at / (72 * 72)) - 36.0), 0.0);
    assert_int_equal(lumens_fill(&v, 0.0, NULL, &share, NULL), STATUS_OK);
    assert_true(share == 0.0);
    volume_release(&v);
}

/* Hollow fibers are noticed where they do not all touch. The gaps of a tight bundle of solid ones are enclosed too, and
 * are not taken for lumens. */
static void test_hollow_fibers_are_noticed(void **state)
{
    (void)state;
    for (int hollow = 0; hollow < 2; hollow++) {
        struct volume v;
        struct lumen_evidence e;
        make_bundle(hollow * 0.4 * radius, hollow == 1 ? 8.6 : tight, &v);
        assert_int_equal(lumen_evidence_measure(&v, noise_sd, NULL, &e, NULL), STATUS_OK);
        print_message("hollow %d: enclosed %.3f, width %.2f, in the middle %.5f\n", hollow, e.enclosed_share,
                      e.width_voxel, e.middle_share);
        assert_true(e.enclosed_share > 0.005);
        assert_int_equal(lumen_evidence_judge(&e), hollow == 1 ? LUMENS_CLEAR : LUMENS_NOT_SEEN);
        volume_release(&v);
    }
}

/* Void above a cloth is outside wherever it begins: here it fills the last ten slices of 81, and no block of twelve
 * slices that are counted from the first one. */
static void test_thin_void_is_outside(void **state)
{
    (void)state;
    const size_t n[3] = {48, 48, 81};
    struct volume v;
    double share;
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    for (size_t at = 0; at < volume_n_voxel(n); at++) {
        const size_t k = at / (48 * 48);
        v.density[at] = k >= 20 && k < 71 ? 1.0f : 0.0f;
    }
    assert_int_equal(lumens_fill(&v, 0.0, NULL, &share, NULL), STATUS_OK);
    assert_true(share == 0.0 && v.filled.n == 0);
    volume_release(&v);
}

/* Share of the filled voxels that lie within `reach` of the middle of a fiber. */
static double share_in_lumens(const struct volume *v, double pitch, double reach)
{
    size_t n = 0;
    for (size_t i = 0; i < v->filled.n; i++) {
        const size_t at = v->filled.voxel[i];
        bool inside = false;
        for (int f = 0; f < 19 && !inside; f++) {
            double cy, cz;
            middle_of(f, pitch, &cy, &cz);
            inside = hypot((double)(at / 72 % 72) + 0.5 - cy, (double)(at / (72 * 72)) + 0.5 - cz) < reach;
        }
        n += inside;
    }
    return v->filled.n > 0 ? (double)n / (double)v->filled.n : 0.0;
}

/* Of the voids that hollow fibers side by side enclose, the gaps between them are emptied again and the lumens stay.
 * Gaps are 40 % of what is enclosed; a tenth of them, about 4 %, may stay. */
static void test_gaps_are_filtered_out(void **state)
{
    (void)state;
    const double pitch = 8.0, lumen = 0.4 * radius;
    struct volume v, before;
    double share;
    make_bundle(lumen, pitch, &v);
    make_bundle(lumen, pitch, &before);
    assert_int_equal(lumens_fill(&v, noise_sd, NULL, &share, NULL), STATUS_OK);
    const double filled = share_in_lumens(&v, pitch, radius), filled_share = share;
    assert_int_equal(lumens_filter(&v, 2.0 * radius, NULL, &share, NULL), STATUS_OK);
    const double filtered = share_in_lumens(&v, pitch, radius);
    print_message("in fibers: %.3f of what is enclosed (%.3f), %.3f once filtered (%.3f)\n", filled, filled_share,
                  filtered, share);
    assert_true(filled < 0.9 && filtered > 0.96);
    assert_true(middle_density(&v, pitch, 0.8 * lumen) > 0.95);
    volume_restores(&v, &before);
    volume_release(&v);
    volume_release(&before);
}

/* Walls of 1.6 voxels in noise of a fourth of the step close their lumens. */
static void test_lumens_of_thin_fibers(void **state)
{
    (void)state;
    const double outer = 2.7, lumen = 0.4 * outer, pitch = 6.2, sd = 0.25;
    struct volume v;
    double share;
    make_bundle_of(outer, lumen, pitch, sd, &v);
    const double before = middle_density(&v, pitch, 1.0);
    assert_int_equal(lumens_fill(&v, sd, NULL, &share, NULL), STATUS_OK);
    print_message("density of the middles of thin fibers %.3f, before %.3f\n", middle_density(&v, pitch, 1.0), before);
    assert_true(middle_density(&v, pitch, 1.0) > 0.9); /* 0.36 where the scan is smoothed on all sides */
    volume_release(&v);
}

/* Along a slanting fiber the mean has less noise, and the section stays as sharp. A Gaussian of 2 voxels leaves 0.38 of
 * white noise along an axis, and less in between, where voxels are interpolated. */
static void test_smoothing_along_a_fiber(void **state)
{
    (void)state;
    static uint8_t smooth[40 * 40 * 40];
    const size_t n[3] = {40, 40, 40};
    const double u[3] = {0.8, 0.48, 0.36}, sd = 0.2;
    const struct rng_key key = {.seed = 9};
    double sum[3] = {0.0}, square = 0.0; /* error amid the fiber, at its edge, and outside of it */
    size_t count[3] = {0};
    struct rng r;
    struct volume v;
    rng_start(&r, &key, 0, 0);
    assert_int_equal(volume_init(&v, n, voxel_m, NULL), STATUS_OK);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t at = 0; at < volume_n_voxel(n); at++) {
            const double p[3] = {(double)(at % 40) - 19.6, (double)(at / 40 % 40) - 19.3, (double)(at / 1600) - 19.4};
            const double t = p[0] * u[0] + p[1] * u[1] + p[2] * u[2];
            const double distance = sqrt(fmax(0.0, p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - t * t));
            const double true_density = 0.2 + 0.6 * profile(distance, 0.0);
            double z[2];
            rng_normal_pair(&r, z);
            if (pass == 0) v.density[at] = (float)fmin(1.0, fmax(0.0, true_density + sd * z[0]));
            if (pass == 0 || fabs(t) > 12.0) continue;
            const int place = distance < 2.0 ? 0 : fabs(distance - radius) < 0.5 ? 1 : distance > 5.0 ? 2 : -1;
            if (place < 0 || distance > 7.0) continue;
            const double error = (double)smooth[at] / 250.0 - true_density;
            sum[place] += error;
            square += place == 0 ? error * error : 0.0;
            count[place]++;
        }
        if (pass == 0) assert_int_equal(density_smooth_along(&v, NULL, 250, smooth, NULL), STATUS_OK);
    }
    for (int i = 0; i < 3; i++) sum[i] /= (double)count[i];
    const double noise = sqrt(square / (double)count[0] - sum[0] * sum[0]);
    print_message("errors %.3f, %.3f and %.3f; noise %.3f of %.3f\n", sum[0], sum[1], sum[2], noise, sd);
    /* clamping costs 0.02 at densities of 0.2 and 0.8; linear interpolation blurs the edge by a variance of 1/6 to 1/4
     * voxel, which moves none of its mean */
    for (int i = 0; i < 3; i++) assert_true(fabs(sum[i]) < 0.05);
    assert_true(noise < 0.38 * sd);
    volume_release(&v);
}

/* A plain weave of 2 x 2 yarns of 7 voxels, mapped to densities, with lumens looked for and filled. */
struct plain_scan {
    uint64_t seed;
    double lumen, radius_spread, snr, noise_sd_voxel;
};

static void look_at_plain(const struct plain_scan *p, struct volume *v, struct reconstruct_report *report)
{
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_report made;
    struct density_modes m;
    struct fiber_set truth;
    struct reconstruct_option option;
    *report = (struct reconstruct_report){0};
    phantom_cloth_of_diameter(&o, PHANTOM_PLAIN, 7.0);
    phantom_scan_option_default(&scan);
    reconstruct_option_default(&option);
    o.n_yarn[0] = o.n_yarn[1] = 2;
    o.seed = scan.seed = p->seed;
    o.radius_spread = p->radius_spread;
    if (p->lumen > 0.0) o.section = (struct phantom_section_law){.seed = p->seed, .lumen = p->lumen};
    scan.snr = p->snr;
    scan.noise_sd_voxel = p->noise_sd_voxel;
    scan.voxel_size_m = o.voxel_size_m;
    scan.section = o.section;
    fiber_set_init(&truth);
    assert_int_equal(phantom_generate(&o, NULL, NULL, &truth, &made, NULL), STATUS_OK);
    assert_int_equal(phantom_scan(&truth, made.n_voxel, &scan, NULL, NULL, v, NULL), STATUS_OK);
    assert_int_equal(density_modes_find(v, &m, NULL), STATUS_OK);
    assert_int_equal(scan_densities_map(v, m.low, m.high, NAN, NULL, &report->noise, NULL), STATUS_OK);
    assert_int_equal(reconstruct_lumens(v, &option, NULL, report, NULL), STATUS_OK);
    print_message("lumens %.2f, signal-to-noise %.0f: middles %.5f, enclosed %.4f, seen %d, filled %.3f\n", p->lumen,
                  p->snr, report->lumen.middle_share, report->lumen.enclosed_share, report->lumens_found,
                  report->lumen_share);
    fiber_set_release(&truth);
}

/* The diameter of hollow fibers is that of their outlines, not of their walls, also under thin layers of void. */
static void test_diameter_of_hollow_fibers(void **state)
{
    (void)state;
    struct fiber_diameter d;
    struct reconstruct_report report;
    struct volume v;
    look_at_plain(&(struct plain_scan){.seed = 3, .lumen = 0.4, .snr = 5.0}, &v, &report);
    assert_int_equal(fiber_diameter_measure(&v, NULL, NULL, &d, NULL), STATUS_OK);
    print_message("diameter %.2f\n", d.voxel);
    assert_true(report.lumens_found);
    assert_true(fabs(d.voxel / 7.0 - 1.0) < 0.1);
    volume_release(&v);
}

/* A scan that hides lumens does not call hollow fibers solid; one that would show them calls solid fibers so. */
static void test_lumens_that_cannot_be_seen_are_told(void **state)
{
    (void)state;
    static const struct {
        struct plain_scan scan;
        enum lumen_answer expected;
    } c[] = {{{4, 0.4, 0.0, 2.0, 0.0}, LUMENS_UNKNOWN},
             {{4, 0.4, 0.2, 2.0, 1.0}, LUMENS_UNKNOWN},
             {{4, 0.0, 0.0, 2.0, 0.0}, LUMENS_UNKNOWN},
             {{4, 0.0, 0.2, 3.0, 0.5}, LUMENS_NONE},
             {{4, 0.4, 0.2, 3.0, 0.5}, LUMENS_FILLED}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        struct reconstruct_report report;
        struct fiber_diameter d;
        struct volume v;
        look_at_plain(&c[i].scan, &v, &report);
        assert_int_equal(fiber_diameter_measure(&v, NULL, NULL, &d, NULL), STATUS_OK);
        report.fiber_diameter_voxel = d.voxel;
        report.grade.verdict = GRADE_RESOLVED;
        reconstruct_tell_lumens(&v, &report);
        print_message("%s\n", lumen_answer_name(report.lumens));
        assert_int_equal(report.lumens, c[i].expected);
        report.grade.verdict = GRADE_UNRESOLVED;
        reconstruct_tell_lumens(&v, &report);
        assert_int_equal(report.lumens, c[i].expected == LUMENS_NONE ? LUMENS_UNKNOWN : c[i].expected);
        volume_release(&v);
    }
}

/* Lumens in strong noise where radii differ are seen; solid fibers of the same cloth are solid. */
static void test_lumens_in_noise_are_seen(void **state)
{
    (void)state;
    static const struct plain_scan scan[] = {{5, 0.4, 0.2, 3.0, 0.5}, {5, 0.0, 0.2, 3.0, 0.5}};
    for (size_t i = 0; i < sizeof scan / sizeof *scan; i++) {
        struct reconstruct_report report;
        struct volume v;
        look_at_plain(&scan[i], &v, &report);
        assert_int_equal(lumen_evidence_judge(&report.lumen), scan[i].lumen > 0.0 ? LUMENS_CLEAR : LUMENS_NOT_SEEN);
        volume_release(&v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lumens_are_filled),         cmocka_unit_test(test_nothing_is_enclosed),
        cmocka_unit_test(test_hollow_fibers_are_noticed), cmocka_unit_test(test_thin_void_is_outside),
        cmocka_unit_test(test_gaps_are_filtered_out),     cmocka_unit_test(test_lumens_of_thin_fibers),
        cmocka_unit_test(test_smoothing_along_a_fiber),   cmocka_unit_test(test_diameter_of_hollow_fibers),
        cmocka_unit_test(test_lumens_in_noise_are_seen),  cmocka_unit_test(test_lumens_that_cannot_be_seen_are_told)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
