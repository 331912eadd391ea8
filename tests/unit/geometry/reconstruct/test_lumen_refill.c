/* Hollow fibers of different diameters: more of their lumens are filled once they were traced. */
#include "geometry/reconstruct/trace_job.h"
#include "geometry/volume/density_map.h"
#include "tests/support/scan/phantom_reconstruction.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void add_line(struct polyline_set *lines, int n_vertex, float y, float radius)
{
    assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
    lines->radius[lines->n_line - 1] = radius;
    for (int i = 0; i < n_vertex; i++)
        assert_int_equal(polyline_add(lines, (float[3]){(float)i + 0.5f, y, 12.1f}, NULL), STATUS_OK);
}

/* The inner parts of fibers are marked, 0.6 of the radius, but not those of short lines; marks that are there stay. */
static void test_cores_are_marked(void **state)
{
    (void)state;
    static const size_t n[3] = {40, 48, 24};
    uint8_t *mark = calloc(volume_n_voxel(n), 1);
    size_t n_marked = 0, n_beside = 0, n_slice = 0;
    struct polyline_set lines;
    assert_non_null(mark);
    polyline_set_init(&lines);
    add_line(&lines, 40, 12.3f, 5.0f);
    add_line(&lines, 8, 36.0f, 5.0f);
    const size_t middle = volume_index(n, 20, 12, 12);
    mark[middle] = 1;
    trace_mark_cores(&lines, 8.0, n, 2, mark);
    for (size_t at = 0; at < volume_n_voxel(n); at++) {
        const double y = (double)(at / n[0] % n[1]) + 0.5 - 12.3, z = (double)(at / (n[0] * n[1])) + 0.5 - 12.1;
        n_marked += mark[at] != 0;
        n_beside += mark[at] != 0 && hypot(y, z) > 3.001;
        n_slice += mark[at] != 0 && at % n[0] == 20;
    }
    print_message("%zu voxels marked, %zu in a slice of %.1f\n", n_marked, n_slice, M_PI * 9.0);
    assert_int_equal(n_beside, 0);
    assert_true(fabs((double)n_slice - M_PI * 9.0) < 4.0); /* voxels whose centers are near the outline */
    assert_int_equal(mark[middle], 1);
    assert_int_equal(mark[middle + 1], 2);
    polyline_set_release(&lines);
    free(mark);
}

/* Share of the lumens of a cloth that is filled. */
static double filled_share(const struct fiber_set *f, const struct volume *v)
{
    size_t n = 0, n_filled = 0;
    for (size_t i = 0; i < f->n_vertex; i++) {
        size_t x[3];
        bool inside = true;
        for (size_t a = 0; a < 3; a++) {
            const double p = (double)f->position_m[3 * i + a] / v->voxel_size_m[a];
            inside = inside && p >= 0.0 && p < (double)v->n[a];
            x[a] = inside ? (size_t)p : 0;
        }
        n += inside;
        n_filled += inside && v->density[volume_index(v->n, x[0], x[1], x[2])] == 1.0f;
    }
    return n > 0 ? (double)n_filled / (double)n : 0.0;
}

/* What a computation reports: the largest fraction so far, as a job shows it, and how often it rose. */
struct reports {
    double most;
    int n_rise;
};

static void note_report(void *context, double fraction)
{
    struct reports *r = context;
    assert_in_range((int)(100.0 * fraction), 0, 100);
    r->n_rise += fraction > r->most;
    r->most = fmax(r->most, fraction);
}

/* Reads a plain weave of hollow fibers. *before, *after: share of the lumens that is filled without traced fibers, and
 * with them. knows_spread: with the spread of the radii in a part of the scan. Returns whether that changed any voxel.
 */
static bool fill_plain(double radius_spread, bool knows_spread, double *before, double *after)
{
    struct phantom_option o;
    struct phantom_scan_option scan;
    struct phantom_report made;
    struct density_modes m;
    struct fiber_set truth;
    struct reconstruct_option option;
    struct reconstruct_report report = {0};
    struct thread_pool *pool = NULL;
    struct volume v;
    phantom_cloth_of_diameter(&o, PHANTOM_PLAIN, 7.0);
    phantom_scan_option_default(&scan);
    reconstruct_option_default(&option);
    o.n_yarn[0] = o.n_yarn[1] = 2;
    o.seed = scan.seed = 7;
    o.radius_spread = radius_spread;
    o.section = scan.section = (struct phantom_section_law){.seed = 7, .lumen = 0.4};
    scan.snr = 5.0;
    scan.noise_sd_voxel = 0.5;
    scan.voxel_size_m = o.voxel_size_m;
    fiber_set_init(&truth);
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    assert_int_equal(phantom_generate(&o, pool, NULL, &truth, &made, NULL), STATUS_OK);
    assert_int_equal(phantom_scan(&truth, made.n_voxel, &scan, pool, NULL, &v, NULL), STATUS_OK);
    assert_int_equal(density_modes_find(&v, &m, NULL), STATUS_OK);
    assert_int_equal(scan_densities_map(&v, m.low, m.high, NAN, pool, &report.noise, NULL), STATUS_OK);
    assert_int_equal(reconstruct_lumens(&v, &option, pool, &report, NULL), STATUS_OK);
    assert_true(report.lumens_found);
    *before = filled_share(&truth, &v);
    const size_t n_byte = volume_n_voxel(v.n) * sizeof *v.density;
    float *density = malloc(n_byte);
    assert_non_null(density);
    memcpy(density, v.density, n_byte);
    print_message("radii of the lines that show lumens spread by %.3f\n", report.lumen.radius_spread);
    assert_int_equal(reconstruct_refills(&v, &report), radius_spread > 0.0);
    if (!knows_spread) report.lumen.radius_spread = NAN;
    if (reconstruct_refills(&v, &report)) {
        atomic_bool stop = true;
        const struct progress cancelled = {.cancel = &stop};
        assert_int_equal(reconstruct_refill_lumens(&v, &option, pool, &cancelled, &report, NULL), STATUS_CANCELLED);
        assert_memory_equal(density, v.density, n_byte);
    }
    struct reports reports = {0};
    const struct progress reported = {.report = note_report, .context = &reports};
    assert_int_equal(reconstruct_refill_lumens(&v, &option, pool, &reported, &report, NULL), STATUS_OK);
    print_message("progress rose %d times\n", reports.n_rise);
    if (reconstruct_refills(&v, &report)) {
        assert_true(reports.n_rise > 50); /* not only at the end of each tracing */
        assert_float_equal(reports.most, 1.0, 1e-12);
    }
    *after = filled_share(&truth, &v);
    const bool changed = memcmp(density, v.density, n_byte) != 0;
    for (size_t i = 0; i < v.filled.n; i++) assert_true(v.density[v.filled.voxel[i]] == 1.0f);
    free(density);
    volume_release(&v);
    fiber_set_release(&truth);
    thread_pool_free(pool);
    return changed;
}

static void test_traced_fibers_are_filled(void **state)
{
    (void)state;
    double before, after;
    const bool changed = fill_plain(0.2, true, &before, &after);
    print_message("diameters that differ: lumens filled %.3f, and with traced fibers %.3f\n", before, after);
    assert_true(changed);
    assert_true(1.0 - after < 0.7 * (1.0 - before)); /* of what was missing, at least 30 % less */
}

/* Fibers that are alike were all filled before, and their scan stays as it is. */
static void test_like_fibers_stay(void **state)
{
    (void)state;
    double before, after;
    for (int knows_spread = 0; knows_spread < 2; knows_spread++) { /* if it is known, they are not even traced */
        const bool changed = fill_plain(0.0, knows_spread, &before, &after);
        print_message("fibers that are alike: lumens filled %.3f\n", before);
        assert_false(changed);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cores_are_marked),
        cmocka_unit_test(test_traced_fibers_are_filled),
        cmocka_unit_test(test_like_fibers_stay),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
