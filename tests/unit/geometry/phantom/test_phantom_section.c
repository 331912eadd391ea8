/* Phantoms of fibers that are not alike: radii that spread, sections that are hollow, flat and bent, and the errors of
 * real scanners: correlated noise, beam hardening and phase fringes. */
#include "geometry/phantom/phantom.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const size_t n_voxel[3] = {30, 48, 48};
static const double voxel_m = 2e-6;

/* One straight fiber along x in the middle of the volume, in steps of one voxel. */
static struct fiber_set straight_fiber(double radius_voxel)
{
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 1, n_voxel[0] + 1, NULL), STATUS_OK);
    f.first_vertex[1] = n_voxel[0] + 1;
    f.tile_size_m[0] = voxel_m * (double)n_voxel[0];
    f.tile_size_m[1] = voxel_m * (double)n_voxel[1];
    f.radius_m[0] = (float)(radius_voxel * voxel_m);
    for (size_t k = 0; k <= n_voxel[0]; k++) {
        f.position_m[3 * k] = (float)(voxel_m * (double)k);
        f.position_m[3 * k + 1] = (float)(voxel_m * 24.2);
        f.position_m[3 * k + 2] = (float)(voxel_m * 23.9);
    }
    return f;
}

static struct volume scan_of(const struct fiber_set *f, const struct phantom_scan_option *o)
{
    struct volume v;
    struct error err = {0};
    if (phantom_scan(f, n_voxel, o, NULL, NULL, &v, &err) != STATUS_OK) fail_msg("%s", err.text);
    return v;
}

/* Area and second moments of the material in slice x = i, about the axis; yy, yz, zz. */
static double moments(const struct volume *v, size_t i, double moment[3])
{
    double area = 0.0;
    for (int m = 0; m < 3; m++) moment[m] = 0.0;
    for (size_t k = 0; k < n_voxel[2]; k++)
        for (size_t j = 0; j < n_voxel[1]; j++) {
            double share = (double)v->density[volume_index(n_voxel, i, j, k)], y = (double)j + 0.5 - 24.2,
                   z = (double)k + 0.5 - 23.9;
            area += share;
            moment[0] += share * y * y;
            moment[1] += share * y * z;
            moment[2] += share * z * z;
        }
    return area;
}

static void test_sections_have_area_and_axes(void **state)
{
    (void)state;
    const struct phantom_section_law law[] = {
        {1, .lumen = 0.5}, {2, .aspect = 2.5}, {3, .aspect = 4.0, .turns_per_m = 5e3}, {5, 0.4, 2.0, 0.0, 2e3}};
    for (size_t i = 0; i < sizeof law / sizeof *law; i++) {
        const double r = 7.0;
        struct fiber_set f = straight_fiber(r);
        struct phantom_scan_option o;
        phantom_scan_option_default(&o);
        o.snr = o.blur_sd_voxel = 0.0;
        o.section = law[i];
        struct volume v = scan_of(&f, &o);
        struct phantom_section c = phantom_section_of(&law[i], 0);
        for (size_t x = 2; x < 28; x += 5) {
            double m[3], area = moments(&v, x, m), hollow = 1.0 - pow(c.lumen, 4.0);
            assert_true(fabs(area / (M_PI * r * r * (1.0 - c.lumen * c.lumen)) - 1.0) < 0.02);
            double angle = c.angle_rad + c.turn_rad_per_m * voxel_m * ((double)x + 0.5);
            /* across the fiber +x the angle counts from +-y, towards z on the same side */
            double half = 0.25 * M_PI * r * r * r * r * hollow, a2 = half * c.aspect, b2 = half / c.aspect,
                   want[3] = {cos(angle) * cos(angle) * a2 + sin(angle) * sin(angle) * b2,
                              cos(angle) * sin(angle) * (a2 - b2),
                              sin(angle) * sin(angle) * a2 + cos(angle) * cos(angle) * b2};
            for (int k = 0; k < 3; k++)
                if (fabs(m[k] - want[k]) > 0.04 * (a2 + b2))
                    fail_msg("law %zu, x %zu, moment %d: %g, not %g", i, x, k, m[k], want[k]);
        }
        volume_release(&v);
        fiber_set_release(&f);
    }
}

static void test_a_lumen_is_empty_all_along(void **state)
{
    (void)state;
    struct fiber_set f = straight_fiber(7.0);
    struct phantom_scan_option o;
    phantom_scan_option_default(&o);
    o.snr = o.blur_sd_voxel = 0.0;
    o.section = (struct phantom_section_law){.seed = 1, .lumen = 0.5};
    struct volume v = scan_of(&f, &o);
    for (size_t i = 0; i < n_voxel[0]; i++) {
        assert_true(v.density[volume_index(n_voxel, i, 24, 23)] == 0.0f);
        assert_true(v.density[volume_index(n_voxel, i, 24 + 5, 23)] == 1.0f);
    }
    volume_release(&v);
    fiber_set_release(&f);
}

/* A bean's axis lies outside of the middle of its long axis: the third moment along the short axis is not 0. */
static void test_a_bean_is_bent(void **state)
{
    (void)state;
    const double r = 7.0;
    double share[2][2] = {{0}};
    for (int bent = 0; bent < 2; bent++) {
        struct phantom_section c = {.aspect = 2.0, .bean = bent ? 0.4 : 0.0};
        double a = r * sqrt(c.aspect);
        share[bent][0] = phantom_section_share(&c, r, 0.95 * a, 0.35 * r);
        share[bent][1] = phantom_section_share(&c, r, 0.95 * a, -0.35 * r);
        double area = 0.0;
        for (int i = -30; i <= 30; i++)
            for (int j = -30; j <= 30; j++) area += phantom_section_share(&c, r, 0.5 * i, 0.5 * j) / 4.0;
        assert_true(fabs(area / (M_PI * r * r) - 1.0) < 0.02);
    }
    assert_true(fabs(share[0][0] - share[0][1]) < 1e-9 && share[1][0] > 0.9 && share[1][1] == 0.0);
}

static void test_noise_is_correlated(void **state)
{
    (void)state;
    struct fiber_set f = straight_fiber(2.0);
    struct phantom_scan_option o;
    phantom_scan_option_default(&o);
    o.snr = 0.0;
    struct volume clean = scan_of(&f, &o);
    o.snr = 5.0;
    o.noise_sd_voxel = 0.8;
    struct volume v = scan_of(&f, &o);
    double square = 0.0, product[3] = {0}, count = 0.0, first = 0.0;
    for (size_t k = 0; k + 1 < n_voxel[2]; k++)
        for (size_t j = 0; j + 1 < n_voxel[1]; j++)
            for (size_t i = 0; i + 1 < n_voxel[0]; i++) {
                const size_t next[3] = {volume_index(n_voxel, i + 1, j, k), volume_index(n_voxel, i, j + 1, k),
                                        volume_index(n_voxel, i, j, k + 1)};
                size_t at = volume_index(n_voxel, i, j, k);
                double here = (double)(v.density[at] - clean.density[at]);
                square += here * here;
                if (k == 0) first += here * here;
                for (int a = 0; a < 3; a++) product[a] += here * (double)(v.density[next[a]] - clean.density[next[a]]);
                count += 1.0;
            }
    /* the autocorrelation of white noise after a Gaussian of sd s is exp(-d^2 / (4 s^2)) */
    assert_true(fabs(sqrt(square / count) / 0.2 - 1.0) < 0.03);
    assert_true(fabs(sqrt(first / (29.0 * 47.0)) / 0.2 - 1.0) < 0.1); /* the first slice is as noisy */
    for (int a = 0; a < 3; a++) assert_true(fabs(product[a] / square - exp(-1.0 / (4.0 * 0.64))) < 0.03);
    volume_release(&v);
    volume_release(&clean);
    fiber_set_release(&f);
}

static void test_hardening_and_fringes(void **state)
{
    (void)state;
    struct fiber_set f = straight_fiber(7.0);
    struct phantom_scan_option o;
    phantom_scan_option_default(&o);
    o.snr = 0.0;
    struct volume clean = scan_of(&f, &o);
    o.beam_hardening = 0.5;
    struct volume hard = scan_of(&f, &o);
    o.beam_hardening = 0.0;
    o.phase_fringes = 1.0;
    struct volume fringed = scan_of(&f, &o);
    size_t middle = volume_index(n_voxel, 15, 24, 23), inside = volume_index(n_voxel, 15, 24 + 5, 23),
           outside = volume_index(n_voxel, 15, 24 + 8, 23), far = volume_index(n_voxel, 15, 2, 2);
    double sum[2] = {0};
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) {
        sum[0] += (double)clean.density[i];
        sum[1] += (double)fringed.density[i];
    }
    assert_true(hard.density[middle] < 0.95f * clean.density[middle] && hard.density[middle] > 0.5f);
    assert_true(fringed.density[inside] > clean.density[inside] + 0.05f);
    assert_true(fringed.density[outside] < clean.density[outside] - 0.05f && fringed.density[outside] < 0.0f);
    assert_true(fabsf(fringed.density[far]) < 1e-4f && fabs(sum[1] / sum[0] - 1.0) < 0.01);
    volume_release(&clean);
    volume_release(&hard);
    volume_release(&fringed);
    fiber_set_release(&f);
}

static void test_radii_spread(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report report;
    struct fiber_set f;
    struct error err = {0};
    fiber_set_init(&f);
    phantom_option_default(&o, PHANTOM_FELT);
    o.n_fiber_per_yarn = 300;
    o.felt_tile_m *= 2.0;
    o.felt_thickness_m *= 2.0;
    o.radius_spread = 0.2;
    o.n_relax = 60;
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &report, &err), STATUS_OK);
    double sum = 0.0, square = 0.0, least = INFINITY, count = 0.0;
    for (size_t i = 0; i < f.n_fiber; i++) {
        double ratio = (double)f.radius_m[i] / 7e-6;
        if (i > 0 && f.radius_m[i] == f.radius_m[i - 1]) continue; /* pieces of one strand */
        sum += ratio;
        square += ratio * ratio;
        least = fmin(least, ratio);
        count += 1.0;
    }
    assert_true(count > 290.0 && count <= 300.0);
    assert_true(fabs(sum / count - 1.0) < 0.04 && fabs(sqrt(square / count - pow(sum / count, 2.0)) - 0.2) < 0.03);
    assert_true(least > 0.5 && report.overlap_mean < 0.02);
    fiber_set_release(&f);
}

static void test_wrong_options_are_named(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report report;
    struct fiber_set f, one = straight_fiber(3.0);
    struct error err;
    fiber_set_init(&f);
    phantom_option_default(&o, PHANTOM_PLAIN);
    o.radius_spread = 0.5;
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &report, &err), STATUS_INVALID);
    assert_string_equal(err.field, "radius_spread");
    phantom_option_default(&o, PHANTOM_PLAIN);
    o.section.aspect = 9.0;
    assert_int_equal(phantom_generate(&o, NULL, NULL, &f, &report, &err), STATUS_INVALID);
    assert_string_equal(err.field, "aspect");
    struct phantom_scan_option s;
    struct volume v;
    phantom_scan_option_default(&s);
    s.section.lumen = -1.0;
    assert_int_equal(phantom_scan(&one, n_voxel, &s, NULL, NULL, &v, &err), STATUS_INVALID);
    assert_string_equal(err.field, "lumen");
    phantom_scan_option_default(&s);
    s.phase_fringes = NAN;
    assert_int_equal(phantom_scan(&one, n_voxel, &s, NULL, NULL, &v, &err), STATUS_INVALID);
    assert_string_equal(err.field, "phase_fringes");
    fiber_set_release(&f);
    fiber_set_release(&one);
}

static void test_table_of_sections(void **state)
{
    char line[256];
    const char *path = scratch_path(state, "sections.csv");
    struct fiber_set f = straight_fiber(3.0);
    struct phantom_section_law law = {.seed = 4, .lumen = 0.25, .aspect = 3.0};
    assert_int_equal(phantom_write_sections(&f, &law, path, NULL), STATUS_OK);
    FILE *file = fopen(path, "re");
    assert_non_null(file);
    assert_non_null(fgets(line, sizeof line, file));
    assert_non_null(fgets(line, sizeof line, file));
    double radius_um, lumen, aspect;
    assert_int_equal(sscanf(line, "0,%lf,%lf,%lf", &radius_um, &lumen, &aspect), 3);
    assert_true(fabs(radius_um - 6.0) < 1e-4 && lumen == 0.25);
    assert_true(fabs(aspect - phantom_section_of(&law, 0).aspect) < 1e-4 && aspect > 1.0 && aspect < 3.0);
    assert_null(fgets(line, sizeof line, file));
    fclose(file);
    fiber_set_release(&f);
}

/* Each fiber has a lumen of its own between the narrowest and the widest, which the set states; without lumens nothing
 * about the other numbers changes. */
static void test_lumens_of_single_fibers(void **state)
{
    (void)state;
    const struct phantom_section_law law = {.seed = 4, .lumen = 0.6, .aspect = 3.0, .lumen_spread = 0.5},
                                     solid = {.seed = 4, .aspect = 3.0};
    double least = 1.0, most = 0.0;
    for (size_t i = 0; i < 200; i++) {
        const struct phantom_section s = phantom_section_of(&law, i);
        least = fmin(least, s.lumen);
        most = fmax(most, s.lumen);
        assert_true(s.aspect == phantom_section_of(&solid, i).aspect);
    }
    assert_true(least >= 0.3 && least < 0.32 && most <= 0.6 && most > 0.58);
    const struct phantom_section_law discs = {.seed = 4, .lumen = 0.6, .lumen_spread = 0.5};
    struct fiber_set f = straight_fiber(7.0);
    assert_int_equal(phantom_section_shapes(&discs, &f, NULL), STATUS_OK);
    assert_non_null(f.shape);
    assert_true(fabs((double)f.shape[0].lumen - phantom_section_of(&discs, 0).lumen) < 1e-6);
    fiber_set_release(&f);
}

/* A taper lowers the radius by its share and raises it again, closes at the faces, and is what the scan draws; the
 * true ratio and long axis are those of the scan's second moments. */
static void test_sections_along_a_fiber(void **state)
{
    (void)state;
    const struct phantom_section_law law = {.seed = 4, .aspect = 3.0, .turns_per_m = 5e3, .taper = 0.4};
    struct fiber_set f = straight_fiber(7.0);
    assert_int_equal(phantom_section_shapes(&law, &f, NULL), STATUS_OK);
    float least = INFINITY, most = 0.0f;
    for (size_t k = 0; k < f.n_vertex; k++) {
        least = fminf(least, f.shape[k].radius);
        most = fmaxf(most, f.shape[k].radius);
    }
    assert_true(fabs((double)most / (7.0 * voxel_m) - 1.0) < 0.01 && fabs((double)(least / most) - 0.6) < 0.01);
    assert_true(fabsf(f.shape[0].radius / f.shape[f.n_vertex - 1].radius - 1.0f) < 1e-4f);
    struct volume v = scan_of(&f, &(struct phantom_scan_option){.voxel_size_m = voxel_m, .section = law});
    for (size_t i = 2; i + 2 < n_voxel[0]; i++) {
        double m[3], area = moments(&v, i, m);
        const struct fiber_shape *s = &f.shape[i];
        const double r = (double)(s->radius + f.shape[i + 1].radius) / (2.0 * voxel_m);
        assert_true(fabs(area / (M_PI * r * r) - 1.0) < 0.03);
        const double half = 0.5 * (m[0] - m[2]), spread = sqrt(half * half + m[1] * m[1]), mean = 0.5 * (m[0] + m[2]);
        assert_true(fabs(sqrt((mean + spread) / (mean - spread)) / (double)s->ratio - 1.0) < 0.05);
        const double angle = 0.5 * atan2(m[1], half),
                     cosine = cos(angle) * (double)s->long_axis[1] + sin(angle) * (double)s->long_axis[2];
        assert_true(fabs(cosine) > 0.99); /* the section turns by 1.8 degrees from vertex to vertex */
    }
    volume_release(&v);
    fiber_set_release(&f);
}

/* Sections that the fibers state give the scan of the law that made them, also where they turn and radii vary. Shapes
 * are stored in single precision: an angle is off by up to 1e-7, and so is a share. */
static void test_own_sections(void **state)
{
    (void)state;
    struct phantom_scan_option o;
    struct fiber_set f = straight_fiber(6.0);
    phantom_scan_option_default(&o);
    o.voxel_size_m = voxel_m;
    o.snr = 0.0;
    o.section = (struct phantom_section_law){.seed = 5, .lumen = 0.5, .aspect = 2.5, .turns_per_m = 2e3, .taper = 0.3};
    assert_int_equal(phantom_section_shapes(&o.section, &f, NULL), STATUS_OK);
    struct volume by_law = scan_of(&f, &o);
    o.section = (struct phantom_section_law){0};
    struct volume disc = scan_of(&f, &o);
    o.own_sections = true;
    struct volume own = scan_of(&f, &o);
    double most = 0.0, most_disc = 0.0;
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) {
        most = fmax(most, fabs((double)own.density[i] - (double)by_law.density[i]));
        most_disc = fmax(most_disc, fabs((double)disc.density[i] - (double)by_law.density[i]));
    }
    print_message("largest difference %.2g, of a disc %.2g\n", most, most_disc);
    assert_true(most < 1e-5 && most_disc > 0.5);
    free(f.shape); /* fibers without sections are discs */
    f.shape = NULL;
    struct volume none = scan_of(&f, &o);
    o.own_sections = false;
    struct volume as_ever = scan_of(&f, &o);
    assert_memory_equal(none.density, as_ever.density, volume_n_voxel(n_voxel) * sizeof *none.density);
    volume_release(&by_law);
    volume_release(&disc);
    volume_release(&own);
    volume_release(&none);
    volume_release(&as_ever);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sections_have_area_and_axes),
        cmocka_unit_test(test_a_lumen_is_empty_all_along),
        cmocka_unit_test(test_a_bean_is_bent),
        cmocka_unit_test(test_noise_is_correlated),
        cmocka_unit_test(test_hardening_and_fringes),
        cmocka_unit_test(test_radii_spread),
        cmocka_unit_test(test_sections_along_a_fiber),
        cmocka_unit_test(test_own_sections),
        cmocka_unit_test(test_lumens_of_single_fibers),
        cmocka_unit_test(test_wrong_options_are_named),
        cmocka_unit_test_setup_teardown(test_table_of_sections, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
