/* Sections along fibers in sets, files and volumes: they come back from both file formats, old files have none, files
 * of other programs keep a thickness that varies, and damaged ones are refused. */
#include "geometry/fibers/shape/fiber_correct.h"
#include "geometry/fibers/shape/section_summary.h"
#include "geometry/fibers/voxelise.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_VERTEX = 5 };

/* Two fibers along x, 1 mm long, whose radius falls from 50 to 30 um; sections of ratios 1.2 to 2 whose long axis turns
 * about x. */
static struct fiber_set tapered(bool groups)
{
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 2, 2 * N_VERTEX, NULL), STATUS_OK);
    f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
    for (size_t i = 0; i < 2; i++) {
        f.first_vertex[i + 1] = (i + 1) * N_VERTEX;
        f.radius_m[i] = 40e-6f;
        f.group[i] = groups && i == 1 ? 3 : 0;
    }
    assert_int_equal(fiber_set_add_shapes(&f, NULL), STATUS_OK);
    for (size_t k = 0; k < 2 * N_VERTEX; k++) {
        const size_t at = k % N_VERTEX;
        const float p[3] = {250e-6f * (float)at, k < N_VERTEX ? 250e-6f : 750e-6f, 100e-6f}, angle = 0.3f * (float)at;
        memcpy(f.position_m + 3 * k, p, sizeof p);
        f.shape[k] = (struct fiber_shape){.radius = 50e-6f - 5e-6f * (float)at,
                                          .radius_se = 1e-6f,
                                          .ratio = 1.2f + 0.2f * (float)at,
                                          .ratio_se = 0.02f,
                                          .long_axis = {0.0f, cosf(angle), sinf(angle)},
                                          .angle_se_rad = 0.1f};
    }
    return f;
}

/* Adds lumens: of the first fiber as measured, up to walls of 3 % of the radius; of the second not known. */
static void make_hollow(struct fiber_set *f)
{
    for (size_t k = 0; k < N_VERTEX; k++) {
        f->shape[k].lumen = 0.97f - 0.05f * (float)k;
        f->shape[k].lumen_se = 0.02f;
    }
}

static void compare_shapes(const struct fiber_set *a, const struct fiber_set *b)
{
    assert_int_equal(b->n_vertex, a->n_vertex);
    assert_non_null(b->shape);
    for (size_t k = 0; k < a->n_vertex; k++) {
        const struct fiber_shape *x = &a->shape[k], *y = &b->shape[k];
        assert_true(fabsf(y->radius / x->radius - 1.0f) < 1e-5f && fabsf(y->radius_se / x->radius_se - 1.0f) < 1e-3f);
        assert_true(fabsf(y->ratio - x->ratio) < 1e-5f && fabsf(y->ratio_se - x->ratio_se) < 1e-5f);
        assert_true(fabsf(y->angle_se_rad - x->angle_se_rad) < 1e-4f);
        assert_true(fabsf(y->lumen - x->lumen) < 1e-5f && fabsf(y->lumen_se - x->lumen_se) < 1e-6f);
        for (int c = 0; c < 3; c++) assert_true(fabsf(y->long_axis[c] - x->long_axis[c]) < 1e-5f);
    }
    for (size_t i = 0; i < a->n_fiber; i++) {
        assert_true(fabsf(b->radius_m[i] / a->radius_m[i] - 1.0f) < 1e-5f);
        assert_int_equal(b->group[i], a->group[i]);
    }
}

static void test_files_keep_sections(void **state)
{
    const char *path = scratch_path(state, "sections.hair");
    for (int kind = 0; kind < 4; kind++)
        for (int text = 0; text < 2; text++) {
            struct fiber_set f = tapered(kind % 2 == 1), g;
            fiber_set_init(&g);
            if (kind >= 2) make_hollow(&f);
            assert_int_equal((text ? fiber_set_write_text : fiber_set_write_hair)(&f, path, NULL), STATUS_OK);
            assert_int_equal((text ? fiber_set_read_text : fiber_set_read_hair)(&g, path, NULL), STATUS_OK);
            compare_shapes(&f, &g);
            assert_int_equal(fiber_set_has_lumens(&g), kind >= 2);
            if (!text) assert_int_equal(fiber_set_validate(&g, NULL), STATUS_OK);
            fiber_set_release(&f);
            fiber_set_release(&g);
        }
}

/* Without sections nothing is added to the files, and reading makes none; where only the thickness varies, as in files
 * of other programs, the radius varies and sections are discs that were not measured. */
static void test_files_without_sections(void **state)
{
    const char *path = scratch_path(state, "plain.hair");
    struct fiber_set f = tapered(false), g;
    fiber_set_init(&g);
    free(f.shape);
    f.shape = NULL;
    assert_int_equal(fiber_set_write_hair(&f, path, NULL), STATUS_OK);
    size_t n;
    char *data = scratch_read(path, &n);
    assert_int_equal(n, 128 + 2 * 2 + 16 * 2 * N_VERTEX);
    assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
    assert_null(g.shape);
    const float thick = 0.3f, none = 0.0f;
    memcpy(data + n - 4, &thick, 4); /* the last point of the second fiber; the others have 0.08 mm */
    memcpy(data + n - 8, &none, 4);  /* its neighbour has no thickness */
    scratch_write(path, data, n);
    assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
    assert_non_null(g.shape);
    assert_true(fabsf(g.shape[2 * N_VERTEX - 1].radius - 150e-6f) < 1e-9f && !fiber_shape_has_section(&g.shape[0]));
    assert_true(fabsf(g.radius_m[1] - 0.5e-3f * (3 * 0.08f + 0.3f) / 5) < 1e-9f);
    assert_true(fabsf(g.shape[2 * N_VERTEX - 2].radius / (0.05f * g.radius_m[1]) - 1.0f) < 1e-5f);
    assert_true(fabsf(g.radius_m[0] - 40e-6f) < 1e-10f);
    assert_int_equal(fiber_set_validate(&g, NULL), STATUS_OK);
    const float below = -0.1f;
    struct error err = {0};
    memcpy(data + n - 8, &below, 4);
    scratch_write(path, data, n);
    assert_int_equal(fiber_set_read_hair(&g, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "point 8 has a thickness of -0.1 mm"));
    free(data);
    fiber_set_release(&f);
    fiber_set_release(&g);
}

static void test_damaged_sections_are_refused(void **state)
{
    const char *path = scratch_path(state, "damaged.hair");
    struct fiber_set f = tapered(false), g;
    struct error err = {0};
    size_t n;
    fiber_set_init(&g);
    assert_int_equal(fiber_set_write_hair(&f, path, NULL), STATUS_OK);
    char *data = scratch_read(path, &n);
    const size_t sections = n - 28 * 2 * N_VERTEX;
    const float bad[4] = {0.5f, 300.0f, NAN, 3.0f}; /* ratios; the last is the length of an axis */
    for (int k = 0; k < 4; k++) {
        char *copy = malloc(n);
        assert_non_null(copy);
        memcpy(copy, data, n);
        memcpy(copy + sections + 28 * 3 + (k == 3 ? 16 : 4), &bad[k], 4);
        scratch_write(path, copy, n);
        assert_int_equal(fiber_set_read_hair(&g, path, &err), STATUS_FORMAT);
        assert_non_null(strstr(err.text, "point 3 are no section"));
        free(copy);
    }
    scratch_write(path, data, n - 4);
    assert_int_equal(fiber_set_read_hair(&g, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "its header requires"));
    free(data);
    static const char *const text[] = {"0 0 0 0.1 0 0 1.5 0 0 0 1 0\n1 0 0 0.1 0 0 0.9 0 0 0 1 0\n",
                                       "0 0 0 0.1 0 0 1.5 0 0 0 1 0 0.3 0.1\n1 0 0 0.1 0 0 1.5 0 0 0 1 0 1.2 0.1\n",
                                       "0 0 0 0.1 0 0 1.5 0 0 0 1 0 0.3 0.1\n1 0 0 0.1 0 0 1.5 0 0 0 1 0 0.3\n"};
    for (int k = 0; k < 3; k++) { /* a ratio below 1, a lumen wider than the fiber, and one without its error */
        scratch_write(path, text[k], strlen(text[k]));
        assert_int_equal(fiber_set_read_text(&g, path, &err), STATUS_FORMAT);
        assert_non_null(strstr(err.text, "line 2 is not"));
    }
    fiber_set_release(&f);
    fiber_set_release(&g);
}

/* Corrections scale the radii along fibers, and a copy has its own. The volume is that of cones. */
static void test_radii_along_fibers_are_used(void **state)
{
    (void)state;
    struct fiber_set f = tapered(false), g;
    double value[CORRECTION_N], low, high, voxel_m;
    fiber_set_init(&g);
    for (int k = 0; k < CORRECTION_N; k++) value[k] = k == CORRECT_RADIUS ? 1.1 : k == CORRECT_COMPRESSION ? 1.0 : 0.0;
    assert_int_equal(fiber_correct(&f, value, &g, NULL), STATUS_OK);
    assert_true(fabsf(g.shape[3].radius / f.shape[3].radius - 1.1f) < 1e-5f &&
                fabsf(g.radius_m[0] / f.radius_m[0] - 1.1f) < 1e-5f);
    fiber_set_z_range_m(&f, &low, &high);
    assert_true(fabs(low - 50e-6) < 1e-9 && fabs(high - 150e-6) < 1e-9);
    struct thread_pool *pool = NULL;
    struct direction_volume v = {0};
    const struct voxelise_option option = {.voxel_size_m = 5e-6, .limit_bytes = SIZE_MAX};
    assert_int_equal(thread_pool_new(1, &pool, NULL), STATUS_OK);
    assert_int_equal(fibers_voxelise(&f, &option, pool, NULL, &v, &voxel_m, NULL), STATUS_OK);
    double sum = 0.0, end[2] = {0.0, 0.0};
    for (size_t k = 0; k < v.n[2]; k++)
        for (size_t j = 0; j < v.n[1]; j++)
            for (size_t i = 0; i < v.n[0]; i++) {
                const double share = v.density[volume_index(v.n, i, j, k)] / 255.0;
                sum += share;
                if (i < 4 || i + 4 >= v.n[0]) end[i >= 4] += share / 8.0;
            }
    const double area = M_PI * (50.0 * 50.0 + 50.0 * 30.0 + 30.0 * 30.0) / 3.0 / 25.0; /* mean of the cones, voxels */
    assert_true(fabs(sum / (2.0 * area * (double)v.n[0]) - 1.0) < 0.01);
    assert_true(fabs(end[0] / (M_PI * 49.8 * 49.8 / 25.0) - 1.0) < 0.02 &&
                fabs(end[1] / (M_PI * 30.2 * 30.2 / 25.0) - 1.0) < 0.02);
    direction_volume_release(&v);
    thread_pool_free(pool);
    fiber_set_release(&f);
    fiber_set_release(&g);
}

static void test_summary(void **state)
{
    (void)state;
    struct fiber_set f = tapered(false);
    struct section_summary s;
    assert_int_equal(section_summary_make(&f, 0.0, &s, NULL), STATUS_OK);
    assert_true(fabs(s.ratio_median - 1.6) < 1e-6 && fabs(s.flat_share - 1.0) < 1e-6 && s.n_varying == 2);
    assert_true(fabs(s.ratio_p10 - 1.2) < 1e-6 && fabs(s.ratio_p90 - 2.0) < 1e-6 &&
                fabs(s.measured_share - 1.0) < 1e-9);
    assert_true(fabs(s.variation - sqrt(50.0) / 40.0) < 1e-5 && fabs(s.angle_se_median_rad - 0.1) < 1e-6);
    double all = 0.0;
    for (int b = 0; b < SECTION_N_BIN; b++) all += s.bin_share[b];
    assert_true(fabs(all - 1.0) < 1e-6);
    free(f.shape);
    f.shape = NULL;
    assert_int_equal(section_summary_make(&f, 0.0, &s, NULL), STATUS_OK);
    assert_true(s.measured_share == 0.0 && isnan(s.ratio_median) && s.n_varying == 0);
    fiber_set_release(&f);
}

static void test_validation(void **state)
{
    (void)state;
    struct fiber_set f = tapered(false);
    struct error err = {0};
    f.shape[6].ratio = 0.9f;
    assert_int_equal(fiber_set_validate(&f, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "vertex 1 of fiber 1 has a section"));
    f.shape[6].ratio = 1.0f;
    f.shape[2].radius = 0.0f;
    assert_int_equal(fiber_set_validate(&f, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "vertex 2 of fiber 0 has radius 0 m"));
    f.shape[2].radius = 40e-6f;
    f.shape[7].lumen = 1.0f;
    assert_int_equal(fiber_set_validate(&f, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "vertex 2 of fiber 1 has a lumen of 1 of its width"));
    f.shape[7].lumen = 0.97f;
    assert_int_equal(fiber_set_validate(&f, &err), STATUS_OK);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_files_keep_sections),
        cmocka_unit_test(test_files_without_sections),
        cmocka_unit_test(test_damaged_sections_are_refused),
        cmocka_unit_test(test_radii_along_fibers_are_used),
        cmocka_unit_test(test_summary),
        cmocka_unit_test(test_validation),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
