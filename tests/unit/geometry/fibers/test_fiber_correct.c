/* Corrections of scanned fibers: nothing at the standard values, known effects of each number, and smoothness. */
#include "base/rng.h"
#include "geometry/fibers/shape/fiber_correct.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_FIBER = 3, N_VERTEX = 60 };
static const double spacing_m = 8e-6, noise_m = 0.4e-6;
static const double standard[CORRECTION_N] = {1.0, 1.0, 0.0, 0.0};

/* Straight fibers along x whose vertices are off by noise, as a scan's are. */
static void make_fibers(struct fiber_set *f)
{
    struct rng_key key = {.seed = 3};
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, N_FIBER, N_FIBER * N_VERTEX, NULL), STATUS_OK);
    f->tile_size_m[0] = f->tile_size_m[1] = N_VERTEX * spacing_m;
    for (size_t i = 0; i < N_FIBER; i++) {
        f->first_vertex[i + 1] = (i + 1) * N_VERTEX;
        f->radius_m[i] = 7e-6f;
        f->group[i] = (uint8_t)i;
        for (size_t k = 0; k < N_VERTEX; k++) {
            float *p = f->position_m + 3 * (i * N_VERTEX + k);
            struct rng r;
            double z[2];
            rng_start(&r, &key, (uint32_t)i, (uint32_t)k);
            rng_normal_pair(&r, z);
            p[0] = (float)((double)k * spacing_m);
            p[1] = (float)((double)i * 50e-6 + noise_m * z[0]);
            p[2] = (float)(20e-6 + 40e-6 * (double)i + noise_m * z[1]);
        }
    }
}

/* RMS angle between the segments and x. */
static double direction_noise_rad(const struct fiber_set *f)
{
    double sum = 0.0, n = 0.0;
    for (size_t i = 0; i < N_FIBER; i++) {
        for (size_t v = f->first_vertex[i]; v + 1 < f->first_vertex[i + 1]; v++) {
            const float *a = f->position_m + 3 * v, *b = a + 3;
            double across = hypot((double)(b[1] - a[1]), (double)(b[2] - a[2]));
            sum += pow(atan2(across, (double)(b[0] - a[0])), 2.0);
            n += 1.0;
        }
    }
    return sqrt(sum / n);
}

static void corrected(const struct fiber_set *f, enum correction_number which, double value, struct fiber_set *out)
{
    double all[CORRECTION_N];
    memcpy(all, standard, sizeof all);
    all[which] = value;
    assert_int_equal(fiber_correct(f, all, out, NULL), STATUS_OK);
    assert_int_equal(fiber_set_validate(out, NULL), STATUS_OK);
}

static void test_standard_changes_nothing(void **state)
{
    (void)state;
    struct fiber_set f, out;
    make_fibers(&f);
    fiber_set_init(&out);
    for (int k = 0; k < CORRECTION_N; k++) assert_true(correction_number_table[k].standard == standard[k]);
    assert_int_equal(fiber_correct(&f, standard, &out, NULL), STATUS_OK);
    assert_int_equal(out.n_fiber, f.n_fiber);
    assert_memory_equal(out.position_m, f.position_m, 3 * f.n_vertex * sizeof *f.position_m);
    assert_memory_equal(out.radius_m, f.radius_m, f.n_fiber * sizeof *f.radius_m);
    assert_memory_equal(out.group, f.group, f.n_fiber);
    fiber_set_release(&out);
    fiber_set_release(&f);
}

static void test_radius_and_compression(void **state)
{
    (void)state;
    struct fiber_set f, out;
    double low_m, high_m, low_before_m, high_before_m;
    make_fibers(&f);
    fiber_set_init(&out);
    corrected(&f, CORRECT_RADIUS, 1.2, &out);
    for (size_t i = 0; i < N_FIBER; i++) assert_true(fabs((double)out.radius_m[i] / 7e-6 - 1.2) < 1e-6);
    corrected(&f, CORRECT_COMPRESSION, 0.7, &out);
    fiber_set_z_range_m(&f, &low_before_m, &high_before_m);
    fiber_set_z_range_m(&out, &low_m, &high_m);
    double axes_m = high_m - low_m - 14e-6, axes_before_m = high_before_m - low_before_m - 14e-6;
    assert_true(fabs(axes_m / axes_before_m - 0.7) < 1e-5);
    fiber_set_release(&out);
    fiber_set_release(&f);
}

/* White noise smoothed by a Gaussian of sd s keeps the share spacing / (2 s sqrt(pi)) of its variance. Ends stay. */
static void test_smoothing(void **state)
{
    (void)state;
    struct fiber_set f, out;
    make_fibers(&f);
    fiber_set_init(&out);
    double before = direction_noise_rad(&f);
    corrected(&f, CORRECT_SMOOTHING, 20.0, &out);
    double after = direction_noise_rad(&out), square = 0.0;
    for (size_t k = 15; k < N_VERTEX - 15; k++)
        for (size_t i = 0; i < N_FIBER; i++)
            square += pow((double)out.position_m[3 * (i * N_VERTEX + k) + 1] - (double)i * 50e-6, 2.0);
    double left = square / (N_FIBER * (N_VERTEX - 30)) / (noise_m * noise_m);
    print_message("direction noise %.2f -> %.2f degrees, share of the variance of positions %.3f (expected %.3f)\n",
                  before * 180.0 / M_PI, after * 180.0 / M_PI, left, spacing_m / (2.0 * 20e-6 * sqrt(M_PI)));
    assert_true(after < 0.2 * before);
    assert_true(left < 2.0 * spacing_m / (2.0 * 20e-6 * sqrt(M_PI)));
    for (size_t i = 0; i < N_FIBER; i++)
        for (int a = 0; a < 3; a++) {
            size_t last = f.first_vertex[i + 1] - 1;
            assert_true(fabs((double)(out.position_m[3 * f.first_vertex[i] + (size_t)a] -
                                      f.position_m[3 * f.first_vertex[i] + (size_t)a])) < 1e-9);
            assert_true(fabs((double)(out.position_m[3 * last + (size_t)a] - f.position_m[3 * last + (size_t)a])) <
                        1e-9);
        }
    fiber_set_release(&out);
    fiber_set_release(&f);
}

static void test_hairs_grow(void **state)
{
    (void)state;
    struct fiber_set f, few, more;
    make_fibers(&f);
    fiber_set_init(&few);
    fiber_set_init(&more);
    double area_mm2 = f.tile_size_m[0] * f.tile_size_m[1] * 1e6;
    corrected(&f, CORRECT_HAIRS, 5.3 / area_mm2, &few);
    corrected(&f, CORRECT_HAIRS, 5.4 / area_mm2, &more);
    assert_int_equal(few.n_fiber, N_FIBER + 6);
    assert_int_equal(more.n_fiber, N_FIBER + 6);
    double added_m = fiber_set_length_m(&more) - fiber_set_length_m(&few);
    assert_true(added_m > 0.1 * 150e-6 - 1e-9 && added_m < 0.1 * 450e-6 + 1e-9); /* a tenth of the sixth hair */
    assert_memory_equal(few.position_m, more.position_m, 3 * few.first_vertex[N_FIBER + 5] * sizeof(float));
    double low_m, high_m, low_before_m, high_before_m;
    fiber_set_z_range_m(&f, &low_before_m, &high_before_m);
    fiber_set_z_range_m(&more, &low_m, &high_m);
    assert_true(high_m > high_before_m + 30e-6 && low_m >= low_before_m - 1e-9);
    fiber_set_release(&few);
    fiber_set_release(&more);
    fiber_set_release(&f);
}

static void test_bad_values(void **state)
{
    (void)state;
    struct fiber_set f, out;
    make_fibers(&f);
    fiber_set_init(&out);
    for (int k = 0; k < CORRECTION_N; k++) {
        double value[CORRECTION_N];
        struct error err = {0};
        memcpy(value, standard, sizeof value);
        value[k] = k % 2 == 0 ? NAN : correction_number_table[k].upper * 1.01;
        assert_int_equal(fiber_correct(&f, value, &out, &err), STATUS_INVALID);
        assert_string_equal(err.field, correction_number_table[k].name);
    }
    fiber_set_release(&out);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_standard_changes_nothing),
        cmocka_unit_test(test_radius_and_compression),
        cmocka_unit_test(test_smoothing),
        cmocka_unit_test(test_hairs_grow),
        cmocka_unit_test(test_bad_values),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
