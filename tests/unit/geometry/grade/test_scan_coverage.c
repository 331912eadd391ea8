/* The faults of traced lines that contrast does not show: material without a line, light material, a background that
 * varies, particles, doubled lines, and fibers in pieces. */
#include "base/rng.h"
#include "geometry/grade/scan_grade.h"
#include "geometry/phantom/phantom.h"
#include "geometry/reconstruct/reconstruct.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const size_t n_voxel[3] = {72, 60, 60};
static const double voxel_m = 2e-6, radius = 3.5;

/* n straight lines; line i from from[i] to to[i], in voxels. */
static struct fiber_set lines_of(size_t n, const double from[][3], const double to[][3])
{
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, n, 2 * n, NULL), STATUS_OK);
    for (size_t a = 0; a < 2; a++) f.tile_size_m[a] = voxel_m * (double)n_voxel[a];
    for (size_t i = 0; i < n; i++) {
        f.first_vertex[i + 1] = 2 * (i + 1);
        f.radius_m[i] = (float)(radius * voxel_m);
        for (size_t a = 0; a < 3; a++) {
            f.position_m[6 * i + a] = (float)(voxel_m * from[i][a]);
            f.position_m[6 * i + 3 + a] = (float)(voxel_m * to[i][a]);
        }
    }
    return f;
}

/* Four lines along x, two above and two below. */
static struct fiber_set four(void)
{
    static const double from[4][3] = {{0, 15, 15}, {0, 45, 15}, {0, 15, 45}, {0, 45, 45}};
    static const double to[4][3] = {{72, 15, 15}, {72, 45, 15}, {72, 15, 45}, {72, 45, 45}};
    return lines_of(4, from, to);
}

/* Adds fibers of a density to a scan. */
static void add_scan(struct volume *v, const struct fiber_set *f, float density)
{
    struct phantom_scan_option o;
    struct volume one;
    phantom_scan_option_default(&o);
    o.blur_sd_voxel = 0.7;
    o.snr = 0.0;
    assert_int_equal(phantom_scan(f, n_voxel, &o, NULL, NULL, &one, NULL), STATUS_OK);
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) v->density[i] += density * one.density[i];
    volume_release(&one);
}

static struct volume empty_scan(void)
{
    struct volume v;
    const double size[3] = {voxel_m, voxel_m, voxel_m};
    assert_int_equal(volume_init(&v, n_voxel, size, NULL), STATUS_OK);
    return v;
}

/* Noise of 0.2 of the step, and the clamp of densities. */
static void add_noise(struct volume *v)
{
    struct rng rng;
    const struct rng_key key = {.seed = 5};
    rng_start(&rng, &key, 0, 0);
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) {
        double sum = -6.0; /* of 12 even numbers: nearly normal */
        for (int k = 0; k < 12; k++) sum += rng_double(&rng);
        v->density[i] = (float)fmin(1.0, fmax(0.0, (double)v->density[i] + 0.2 * sum));
    }
}

static struct scan_grade grade_of(const struct volume *v, const struct fiber_set *f, uint8_t *unexplained)
{
    struct scan_grade g, other;
    struct thread_pool *pool;
    const struct coverage_input in = {v, f, 2.0 * radius, 0.7, 0.2};
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    assert_int_equal(scan_grade_measure(v, f, pool, NULL, &g, NULL, NULL), STATUS_OK);
    other = g;
    assert_int_equal(scan_grade_explain(&in, pool, &g, NULL, NULL), STATUS_OK);
    assert_int_equal(scan_grade_explain(&in, NULL, &other, NULL, NULL), STATUS_OK);
    assert_true(g.score == other.score && g.coverage.slice[1] == other.coverage.slice[1]);
    if (unexplained != NULL)
        assert_int_equal(scan_coverage_measure(&in, pool, unexplained, &other.coverage, NULL), STATUS_OK);
    thread_pool_free(pool);
    print_message("explained %.3f (dense %.2f, light %.2f of %.2f), particles %.2f, doubled %.2f, pieces %.2f, misfit "
                  "%.3f, several %.2f: %.3f\n",
                  g.coverage.explained_share, g.coverage.kind[0].explained_share, g.coverage.kind[1].explained_share,
                  g.coverage.kind[1].share, g.likeness.particle_share, g.double_share, g.likeness.fragments,
                  g.section.surface, g.section.several_share, g.score);
    return g;
}

static void test_all_material_has_a_line(void **state)
{
    (void)state;
    struct fiber_set f = four();
    struct volume v = empty_scan();
    add_scan(&v, &f, 1.0f);
    add_noise(&v);
    const struct scan_grade g = grade_of(&v, &f, NULL);
    assert_true(g.faults == 0 && g.score > 0.97 && g.coverage.explained_share > 0.97);
    fiber_set_release(&f);
    volume_release(&v);
}

/* A fiber of a density along y has no line. */
static struct scan_grade without_one(float density, uint8_t *unexplained)
{
    static const double from[1][3] = {{40, 0, 30}}, to[1][3] = {{40, 60, 30}};
    struct fiber_set f = four(), missing = lines_of(1, from, to);
    struct volume v = empty_scan();
    add_scan(&v, &f, 1.0f);
    add_scan(&v, &missing, density);
    add_noise(&v);
    const struct scan_grade g = grade_of(&v, &f, unexplained);
    fiber_set_release(&f);
    fiber_set_release(&missing);
    volume_release(&v);
    return g;
}

static void test_a_missing_fiber(void **state)
{
    (void)state;
    uint8_t *unexplained = malloc(volume_n_voxel(n_voxel));
    const struct scan_grade dense = without_one(1.0f, unexplained), light = without_one(0.35f, NULL);
    const double true_share = 60.0 / (60.0 + 4.0 * 72.0);
    size_t n = 0, n_there = 0;
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) {
        const double x = (double)(i % n_voxel[0]) + 0.5 - 40.0,
                     z = (double)(i / (n_voxel[0] * n_voxel[1])) + 0.5 - 30.0;
        n += unexplained[i];
        n_there += unexplained[i] != 0 && hypot(x, z) < radius + 2.5;
    }
    assert_true(dense.faults == GRADE_UNEXPLAINED && light.faults == GRADE_UNEXPLAINED);
    assert_true(!scan_coverage_has_particles(&dense.coverage) && dense.score < 0.85 && light.score < 0.9);
    assert_true(fabs(1.0 - light.coverage.explained_share - true_share) < 0.05);
    assert_true(1.0 - dense.coverage.explained_share > true_share);
    assert_true(light.coverage.kind[COVERAGE_LIGHT_KIND].explained_share < 0.05);
    assert_true(light.coverage.unexplained_density > 0.15 && light.coverage.unexplained_density < 0.4);
    assert_true(abs((int)dense.coverage.slice[0] - 39) <= 2 && abs((int)dense.coverage.slice[2] - 29) <= 2);
    assert_true((double)n_there > 0.95 * (double)n && n > 1500);
    free(unexplained);
}

/* A light fiber that has a line is explained, and its contrast is that of its kind. */
static void test_a_light_fiber(void **state)
{
    (void)state;
    static const double from[1][3] = {{40, 0, 30}}, to[1][3] = {{40, 60, 30}};
    static const double both_from[5][3] = {{0, 15, 15}, {0, 45, 15}, {0, 15, 45}, {0, 45, 45}, {40, 0, 30}};
    static const double both_to[5][3] = {{72, 15, 15}, {72, 45, 15}, {72, 15, 45}, {72, 45, 45}, {40, 60, 30}};
    struct fiber_set dense = four(), light = lines_of(1, from, to), all = lines_of(5, both_from, both_to);
    struct volume v = empty_scan();
    add_scan(&v, &dense, 1.0f);
    add_scan(&v, &light, 0.35f);
    add_noise(&v);
    const struct scan_grade g = grade_of(&v, &all, NULL);
    assert_true(g.faults == 0 && g.safe_share > 0.95);
    assert_true(g.coverage.kind[COVERAGE_LIGHT_KIND].share > 0.1);
    assert_true(g.coverage.kind[COVERAGE_LIGHT_KIND].explained_share > 0.9);
    fiber_set_release(&dense);
    fiber_set_release(&light);
    fiber_set_release(&all);
    volume_release(&v);
}

/* A bright rim, as of a truncated scan, is no material, and unknown voxels are none. */
static void test_a_background_that_varies(void **state)
{
    (void)state;
    struct fiber_set f = four();
    struct volume v = empty_scan();
    struct volume_run unknown = {0, n_voxel[0] * n_voxel[1] * 6};
    add_scan(&v, &f, 1.0f);
    for (size_t i = 0; i < volume_n_voxel(n_voxel); i++) {
        const double x = (double)(i % n_voxel[0]) / 36.0 - 1.0, y = (double)(i / n_voxel[0] % n_voxel[1]) / 30.0 - 1.0;
        v.density[i] += (float)(0.25 * (x * x + y * y) / 2.0);
        if (i < unknown.end) v.density[i] = 1.0f;
    }
    add_noise(&v);
    v.unknown.n = 1;
    v.unknown.run = &unknown;
    const struct scan_grade g = grade_of(&v, &f, NULL);
    assert_true(!(g.faults & GRADE_UNEXPLAINED) && g.coverage.explained_share > 0.95);
    v.unknown.n = 0;
    v.unknown.run = NULL;
    fiber_set_release(&f);
    volume_release(&v);
}

static void test_particles_doubles_and_pieces(void **state)
{
    (void)state;
    static const double short_from[4][3] = {{20, 15, 15}, {20, 45, 15}, {20, 15, 45}, {20, 45, 45}};
    static const double short_to[4][3] = {{35, 15, 15}, {35, 45, 15}, {35, 15, 45}, {35, 45, 45}};
    static const double twice_from[4][3] = {{0, 15, 15}, {0, 19.5, 15}, {0, 15, 45}, {0, 45, 45}};
    static const double twice_to[4][3] = {{72, 15, 15}, {72, 19.5, 15}, {72, 15, 45}, {72, 45, 45}};
    static const double piece_from[4][3] = {{0, 15, 15}, {41, 15, 15}, {0, 15, 45}, {41, 15, 45}};
    static const double piece_to[4][3] = {{35, 15, 15}, {72, 15, 15}, {35, 15, 45}, {72, 15, 45}};
    struct fiber_set whole = four(), particles = lines_of(4, short_from, short_to);
    struct fiber_set twice = lines_of(4, twice_from, twice_to), pieces = lines_of(4, piece_from, piece_to);
    struct volume v = empty_scan(), balls = empty_scan();
    add_scan(&v, &whole, 1.0f);
    add_scan(&balls, &particles, 1.0f);
    struct scan_grade g = grade_of(&balls, &particles, NULL);
    assert_true(g.faults == GRADE_PARTICLES && g.likeness.particle_share == 1.0 && g.score < GRADE_LEAST_SCORE);
    assert_true(g.likeness.n_end == 8 && g.likeness.n_lost_end == 0);
    g = grade_of(&v, &twice, NULL);
    assert_true((g.faults & GRADE_DOUBLED) && fabs(g.double_share - 0.5) < 0.02);
    g = grade_of(&v, &pieces, NULL);
    assert_true((g.faults & GRADE_PIECES) && g.likeness.n_lost_end == 4 && fabs(g.likeness.fragments - 2.0) < 1e-9);
    fiber_set_release(&whole);
    fiber_set_release(&particles);
    fiber_set_release(&twice);
    fiber_set_release(&pieces);
    volume_release(&v);
    volume_release(&balls);
}

/* Four touching fibers of a radius of two voxels beside each other, each in a line, and all in one line. */
static void test_a_yarn_is_no_fiber(void **state)
{
    (void)state;
    static const double from[4][3] = {{0, 28, 28}, {0, 32, 28}, {0, 30, 31.5}, {0, 34, 31.5}};
    static const double to[4][3] = {{72, 28, 28}, {72, 32, 28}, {72, 30, 31.5}, {72, 34, 31.5}};
    static const double middle[2][3] = {{0, 31, 29.7}, {72, 31, 29.7}};
    struct fiber_set thin = lines_of(4, from, to), one = lines_of(1, &middle[0], &middle[1]), round = four();
    struct volume yarn = empty_scan(), even = empty_scan();
    struct section_misfit misfit;
    for (size_t i = 0; i < 4; i++) thin.radius_m[i] = (float)(2.0 * voxel_m);
    one.radius_m[0] = (float)(4.0 * voxel_m);
    add_scan(&yarn, &thin, 1.0f);
    add_noise(&yarn);
    struct scan_grade g = grade_of(&yarn, &one, NULL);
    assert_true((g.faults & GRADE_SEVERAL) && g.section.surface > 1.5 * SECTION_MOST_MISFIT);
    g = grade_of(&yarn, &thin, NULL);
    assert_true(!(g.faults & GRADE_SEVERAL) && g.section.surface < SECTION_MOST_MISFIT);
    add_scan(&even, &round, 1.0f);
    add_noise(&even);
    assert_int_equal(section_misfit_measure(&even, &round, 0.7, NULL, &misfit, NULL), STATUS_OK);
    assert_true(misfit.surface < 0.03 && misfit.several_share == 0.0);
    for (size_t i = 0; i < 3 * round.first_vertex[4]; i++) round.position_m[i] += (float)(0.4 * voxel_m);
    assert_int_equal(section_misfit_measure(&even, &round, 0.7, NULL, &misfit, NULL), STATUS_OK);
    assert_true(misfit.several_share == 0.0 &&
                misfit.surface < 0.5 * SECTION_MOST_MISFIT); /* an axis off its place is no yarn */
    fiber_set_release(&thin);
    fiber_set_release(&one);
    fiber_set_release(&round);
    volume_release(&yarn);
    volume_release(&even);
}

/* Four thick fibers and a yarn of seven thin ones: with a line for each, and with one line for the yarn, which is
 * little of the length. */
static void test_a_yarn_among_thick_fibers(void **state)
{
    (void)state;
    double from[11][3], to[11][3];
    const double middle[5][2] = {{15, 15}, {45, 15}, {15, 45}, {45, 45}, {30, 30}};
    for (int i = 0; i < 11; i++) {
        const double *m = middle[i < 4 ? i : 4], away = i < 5 ? 0.0 : 4.4, angle = M_PI / 3.0 * i;
        from[i][0] = 0.0;
        to[i][0] = 72.0;
        from[i][1] = to[i][1] = m[0] + away * cos(angle);
        from[i][2] = to[i][2] = m[1] + away * sin(angle);
    }
    struct fiber_set fibers = lines_of(11, (const double(*)[3])from, (const double(*)[3])to);
    struct fiber_set lines = lines_of(5, (const double(*)[3])from, (const double(*)[3])to);
    struct volume v = empty_scan();
    for (size_t i = 4; i < 11; i++) fibers.radius_m[i] = (float)(2.0 * voxel_m);
    lines.radius_m[4] = (float)(6.0 * voxel_m);
    add_scan(&v, &fibers, 1.0f);
    add_noise(&v);
    struct scan_grade g = grade_of(&v, &lines, NULL);
    assert_true((g.faults & GRADE_SEVERAL) && fabs(g.section.several_share - 0.2) < 0.02);
    assert_true(g.section.surface < SECTION_MOST_MISFIT && g.score < 0.7);
    g = grade_of(&v, &fibers, NULL);
    assert_true(!(g.faults & GRADE_SEVERAL) && g.section.several_share == 0.0);
    fiber_set_release(&fibers);
    fiber_set_release(&lines);
    volume_release(&v);
}

/* Balls without a line are material, but no fibers that were missed; nor is a fiber with its axis beyond a face. */
static void test_particles_are_no_missing_fibers(void **state)
{
    (void)state;
    static const double ball_from[3][3] = {{20, 30, 30}, {36, 30, 30}, {52, 30, 30}};
    static const double ball_to[3][3] = {{23, 30, 30}, {39, 30, 30}, {55, 30, 30}};
    static const double edge_from[1][3] = {{0, 30, -1}}, edge_to[1][3] = {{72, 30, -1}};
    struct fiber_set f = four(), balls = lines_of(3, ball_from, ball_to), edge = lines_of(1, edge_from, edge_to);
    struct volume v = empty_scan(), grazed = empty_scan();
    add_scan(&v, &f, 1.0f);
    add_scan(&v, &balls, 1.0f);
    add_noise(&v);
    struct scan_grade g = grade_of(&v, &f, NULL);
    assert_true(g.coverage.explained_share < 0.93 && (g.faults & GRADE_UNEXPLAINED));
    assert_true(g.coverage.particle_share > 0.05 && g.coverage.fiber_share > 0.99 && g.score > 0.97);
    assert_true(scan_coverage_has_particles(&g.coverage));
    add_scan(&grazed, &f, 1.0f);
    add_scan(&grazed, &edge, 1.0f);
    add_noise(&grazed);
    g = grade_of(&grazed, &f, NULL);
    assert_true(g.faults == 0 && g.coverage.explained_share > 0.99);
    fiber_set_release(&f);
    fiber_set_release(&balls);
    fiber_set_release(&edge);
    volume_release(&v);
    volume_release(&grazed);
}

/* The stated error of positions: where fibers touch, blur adds to it, once however often a scan is graded. */
static void test_contact_adds_to_the_error_of_positions(void **state)
{
    (void)state;
    static const double from[2][3] = {{0, 26.5, 30}, {0, 33.5, 30}}, to[2][3] = {{72, 26.5, 30}, {72, 33.5, 30}};
    struct fiber_set apart = four(), touching = lines_of(2, from, to);
    struct reconstruct_report r = {.fiber_diameter_voxel = 7.0, .axis_noise_se_m = 0.1 * voxel_m};
    struct volume v = empty_scan();
    add_scan(&v, &touching, 1.0f);
    r.profile_blur_m = 1.4 * voxel_m;
    for (int i = 0; i < 2; i++) {
        assert_int_equal(reconstruct_grade(&v, &touching, NULL, &r, NULL, NULL), STATUS_OK);
        assert_true(r.grade.beside_share > 0.99);
        assert_true(fabs(r.axis_position_se_m / voxel_m - hypot(0.085, 1.4 * 1.4 / 7.0)) < 0.01);
    }
    assert_int_equal(reconstruct_grade(&v, &apart, NULL, &r, NULL, NULL), STATUS_OK);
    assert_true(fabs(r.axis_position_se_m / voxel_m - 0.085) < 1e-6);
    fiber_set_release(&apart);
    fiber_set_release(&touching);
    volume_release(&v);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_all_material_has_a_line),
        cmocka_unit_test(test_a_missing_fiber),
        cmocka_unit_test(test_a_light_fiber),
        cmocka_unit_test(test_a_background_that_varies),
        cmocka_unit_test(test_particles_doubles_and_pieces),
        cmocka_unit_test(test_particles_are_no_missing_fibers),
        cmocka_unit_test(test_a_yarn_is_no_fiber),
        cmocka_unit_test(test_a_yarn_among_thick_fibers),
        cmocka_unit_test(test_contact_adds_to_the_error_of_positions),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
