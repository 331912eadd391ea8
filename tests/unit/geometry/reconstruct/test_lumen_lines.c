/* Fibers are hollow if traced lines are: void that solid fibers enclose is not taken for lumens. */
#include "base/rng.h"
#include "geometry/reconstruct/reconstruct.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const size_t n_voxel[3] = {72, 72, 72};
static const double voxel_m[3] = {2e-6, 2e-6, 2e-6}, noise_sd = 0.15, radius = 3.5, pitch = 7.3;

/* Density at a distance from the middle of a fiber with a lumen, blurred by 0.7 voxels. */
static double profile(double distance, double lumen)
{
    const double blur = 0.7 * M_SQRT2;
    double hole = lumen > 0.0 ? 0.5 * erfc((distance - lumen) / blur) : 0.0;
    return 0.5 * erfc((distance - radius) / blur) - hole;
}

/* A hexagonal bundle along x of 19 fibers, or of those that are not on the list of missing ones (ends with -1). */
static void make_bundle(double lumen, const int *missing, struct volume *v)
{
    static const int per_row[5] = {3, 4, 5, 4, 3};
    const struct rng_key key = {.seed = 5};
    struct rng r;
    assert_int_equal(volume_init(v, n_voxel, voxel_m, NULL), STATUS_OK);
    rng_start(&r, &key, 0, 0);
    for (size_t at = 0; at < volume_n_voxel(n_voxel); at++) {
        const double y = (double)(at / 72 % 72) + 0.5, z = (double)(at / (72 * 72)) + 0.5;
        double sum = 0.0, noise[2];
        for (int row = 0, fiber = 0; row < 5; row++)
            for (int i = 0; i < per_row[row]; i++, fiber++) {
                bool absent = false;
                for (const int *m = missing; *m >= 0; m++) absent = absent || *m == fiber;
                if (absent) continue;
                sum += profile(
                    hypot(y - 36.3 - pitch * (i - 0.5 * (per_row[row] - 1)), z - 36.1 - pitch * sqrt(0.75) * (row - 2)),
                    lumen);
            }
        rng_normal_pair(&r, noise);
        v->density[at] = (float)fmin(1.0, fmax(0.0, fmin(1.0, sum) + noise_sd * noise[0]));
    }
}

static void look(struct volume *v, int hollow_fibers, struct reconstruct_report *report)
{
    struct reconstruct_option o;
    reconstruct_option_default(&o);
    o.hollow_fibers = hollow_fibers;
    *report = (struct reconstruct_report){.noise = {.scan_sd = noise_sd, .mapped_sd = noise_sd}};
    assert_int_equal(reconstruct_lumens(v, &o, NULL, report, NULL), STATUS_OK);
    print_message("%s: middles %.4f, lines %.3f, filled %.3f\n", lumen_answer_name(report->lumens),
                  report->lumen.middle_share, report->lumen.hollow_share, report->lumen_share);
    assert_int_equal(o.hollow_fibers, hollow_fibers < 0 ? report->lumens_found : hollow_fibers);
}

/* The space of a missing fiber is the middle of a ring of six, as wide as a fiber, and as long. It is filled for a try
 * only. */
static void test_missing_fibers_are_no_lumens(void **state)
{
    (void)state;
    for (int hollow_fibers = -1; hollow_fibers <= 0; hollow_fibers++) {
        struct reconstruct_report r;
        struct volume v, before;
        make_bundle(0.0, (const int[]){8, 10, -1}, &v);
        make_bundle(0.0, (const int[]){8, 10, -1}, &before);
        look(&v, hollow_fibers, &r);
        const double share = r.lumen.hollow_share;
        assert_true(share < 0.15);
        assert_int_equal(lumen_evidence_judge(&r.lumen), LUMENS_NOT_SEEN);
        r.lumen.hollow_share = NAN; /* without lines the evidence is clear */
        assert_int_equal(lumen_evidence_judge(&r.lumen), LUMENS_CLEAR);
        assert_int_equal(r.lumens, hollow_fibers < 0 ? LUMENS_NONE : LUMENS_GIVEN);
        assert_true(r.lumen_share == 0.0 && v.filled.n == 0);
        assert_memory_equal(v.density, before.density, volume_n_voxel(n_voxel) * sizeof *v.density);
        volume_release(&v);
        volume_release(&before);
    }
}

static void test_lumens_are_dark_axes(void **state)
{
    (void)state;
    static const double lumen[2] = {0.3, 0.5};
    for (int i = 0; i < 2; i++) {
        struct reconstruct_report r;
        struct volume v;
        make_bundle(lumen[i] * radius, (const int[]){-1}, &v);
        look(&v, -1, &r);
        assert_true(r.lumen.hollow_share > 0.6);
        assert_int_equal(r.lumens, LUMENS_FILLED);
        assert_true(r.lumen_share > 0.0 && v.filled.n > 0);
        volume_release(&v);
        make_bundle(lumen[i] * radius, (const int[]){-1}, &v);
        look(&v, 0, &r); /* the job says that they are solid: a warning follows from the evidence */
        assert_int_equal(r.lumens, LUMENS_GIVEN);
        assert_int_equal(lumen_evidence_judge(&r.lumen), LUMENS_CLEAR);
        assert_true(v.filled.n == 0);
        volume_release(&v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_missing_fibers_are_no_lumens),
        cmocka_unit_test(test_lumens_are_dark_axes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
