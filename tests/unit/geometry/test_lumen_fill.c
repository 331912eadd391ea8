/* Lumens of hollow fibers are filled, and nothing outside of the fibers. */
#include "base/rng.h"
#include "geometry/orientation/lumen_evidence.h"
#include "geometry/orientation/lumen_fill.h"

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
static double profile(double distance, double lumen)
{
    const double blur = 0.7 * M_SQRT2;
    double hole = lumen > 0.0 ? 0.5 * erfc((distance - lumen) / blur) : 0.0;
    return 0.5 * erfc((distance - radius) / blur) - hole;
}

static void make_bundle(double lumen, double pitch, struct volume *v)
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
            sum += profile(hypot((double)(at / 72 % 72) + 0.5 - cy, (double)(at / (72 * 72)) + 0.5 - cz), lumen);
        }
        rng_normal_pair(&r, z);
        v->density[at] = (float)fmin(1.0, fmax(0.0, fmin(1.0, sum) + noise_sd * z[0]));
    }
}

/* Mean density within `reach` of the middles of fibers. */
static double middle_density(const struct volume *v, double reach)
{
    double sum = 0.0, n = 0.0;
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++)
        for (int i = 0; i < 19; i++) {
            double cy, cz;
            middle_of(i, tight, &cy, &cz);
            if (hypot((double)(at / 72 % 72) + 0.5 - cy, (double)(at / (72 * 72)) + 0.5 - cz) > reach) continue;
            sum += (double)v->density[at];
            n += 1.0;
        }
    return sum / n;
}

static void test_lumens_are_filled(void **state)
{
    (void)state;
    struct volume v, before;
    double share;
    make_bundle(0.45 * radius, tight, &v);
    make_bundle(0.45 * radius, tight, &before);
    double hollow = middle_density(&v, 1.2);
    assert_int_equal(lumens_fill(&v, noise_sd, &share, NULL), STATUS_OK);
    print_message("density of the middles %.3f, before %.3f; filled %.3f\n", middle_density(&v, 1.2), hollow, share);
    assert_true(hollow < 0.5 && middle_density(&v, 1.2) > 0.95);
    assert_true(share > 0.15); /* lumens alone: 0.45^2 / (1 - 0.45^2) = 0.25, and less by the blur */
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++) { /* what is not filled stays, and so does the outside */
        assert_true(v.density[at] == before.density[at] || v.density[at] == 1.0f);
        if (hypot((double)(at / 72 % 72) - 36.0, (double)(at / (72 * 72)) - 36.0) > 24.0)
            assert_true(v.density[at] == before.density[at]);
    }
    struct volume unfilled; /* what was filled is not lost */
    assert_true(v.filled.n > 0);
    assert_int_equal(volume_copy_unfilled(&v, &unfilled, NULL), STATUS_OK);
    assert_memory_equal(unfilled.density, before.density, volume_n_voxel(n_voxel) * sizeof *v.density);
    volume_release(&unfilled);
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
    assert_int_equal(lumens_fill(&v, NAN, &share, NULL), STATUS_OK);
    assert_true(share == 0.0);
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++)
        v.density[at] = (float)profile(hypot((double)(at / 72 % 72) - 30.0, (double)(at / (72 * 72)) - 36.0), 0.0);
    assert_int_equal(lumens_fill(&v, 0.0, &share, NULL), STATUS_OK);
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
        assert_int_equal(lumen_evidence_measure(&v, noise_sd, &e, NULL), STATUS_OK);
        print_message("hollow %d: enclosed %.3f, width %.2f, in the middle %.5f\n", hollow, e.enclosed_share,
                      e.width_voxel, e.middle_share);
        assert_true(e.enclosed_share > 0.005);
        assert_int_equal(lumen_evidence_judge(&e), hollow == 1 ? LUMENS_CLEAR : LUMENS_NOT_SEEN);
        volume_release(&v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lumens_are_filled),
                                       cmocka_unit_test(test_nothing_is_enclosed),
                                       cmocka_unit_test(test_hollow_fibers_are_noticed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
