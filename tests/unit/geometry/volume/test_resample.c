/* Scans with slices thicker than their voxels become cubes of the right size at the right place: known answers. */
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/volume_align.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static const double voxel_m = 2e-6;
static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

/* Fills a volume by a function of the position in voxels of 2 um. */
static struct volume sampled(const size_t n[3], const double spacing[3], double (*value)(const double p[3]))
{
    struct volume v;
    const double size_m[3] = {spacing[0] * voxel_m, spacing[1] * voxel_m, spacing[2] * voxel_m};
    assert_int_equal(volume_init(&v, n, size_m, NULL), STATUS_OK);
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) {
                const double p[3] = {((double)i + 0.5) * spacing[0], ((double)j + 0.5) * spacing[1],
                                     ((double)k + 0.5) * spacing[2]};
                v.density[volume_index(n, i, j, k)] = (float)value(p);
            }
    return v;
}

static struct volume cubes(const struct volume *v)
{
    struct volume out;
    size_t n[3];
    volume_resampled_shape(v->n, v->voxel_size_m, voxel_m, n);
    const size_t box[6] = {0, 0, 0, n[0], n[1], n[2]};
    assert_int_equal(volume_resample(v, identity, voxel_m, box, NULL, NULL, &out, NULL), STATUS_OK);
    return out;
}

/* Two balls of the width of thin fibers, blurred: on a common grid their centres are known exactly. */
static const double ball[2][3] = {{11.3, 12.1, 9.7}, {13.2, 10.9, 29.4}};
static const double ball_sd = 1.6;

static double balls(const double p[3])
{
    double sum = 0.0;
    for (int b = 0; b < 2; b++) {
        double d2 = 0.0;
        for (int a = 0; a < 3; a++) d2 += (p[a] - ball[b][a]) * (p[a] - ball[b][a]);
        sum += exp(-0.5 * d2 / (ball_sd * ball_sd));
    }
    return sum;
}

/* Centre of mass near ball b, in voxels of the resampled volume. */
static void centre_of(const struct volume *v, int b, double c[3])
{
    double sum = 0.0;
    c[0] = c[1] = c[2] = 0.0;
    for (size_t k = 0; k < v->n[2]; k++)
        for (size_t j = 0; j < v->n[1]; j++)
            for (size_t i = 0; i < v->n[0]; i++) {
                const double p[3] = {(double)i + 0.5, (double)j + 0.5, (double)k + 0.5};
                if (fabs(p[2] - ball[b][2]) > 9.0) continue;
                double d = (double)v->density[volume_index(v->n, i, j, k)];
                sum += d;
                for (int a = 0; a < 3; a++) c[a] += d * p[a];
            }
    for (int a = 0; a < 3; a++) c[a] /= sum;
}

static void test_thick_slices_keep_their_places(void **state)
{
    (void)state;
    /* heights that are whole numbers of cubes and not: 27 x 1.5 = 40.5 */
    static const double spacing[][3] = {
        {1.0, 1.0, 1.5}, {1.0, 1.0, 1.5}, {1.0, 1.0, 1.3}, {1.25, 1.0, 1.7}, {1.0, 1.0, 2.0}};
    static const size_t slices[] = {26, 27, 31, 25, 20};
    for (size_t i = 0; i < sizeof spacing / sizeof *spacing; i++) {
        const size_t n[3] = {(size_t)round(24.0 / spacing[i][0]), 24, slices[i]};
        struct volume v = sampled(n, spacing[i], balls), out = cubes(&v);
        for (int a = 0; a < 3; a++) assert_true(out.voxel_size_m[a] == voxel_m);
        assert_true(fabs((double)out.n[2] - (double)n[2] * spacing[i][2]) <= 0.5);
        double c[2][3], peak = 0.0;
        for (int b = 0; b < 2; b++) {
            centre_of(&out, b, c[b]);
            for (int a = 0; a < 3; a++)
                if (fabs(c[b][a] - ball[b][a]) > 0.01)
                    fail_msg("spacing %zu, ball %d, axis %d: %.4f, not %.4f", i, b, a, c[b][a], ball[b][a]);
        }
        assert_true(fabs(c[1][2] - c[0][2] - (ball[1][2] - ball[0][2])) < 0.01);
        /* and the value at each cube is that of the balls there: no blur */
        for (size_t k = 0; k < volume_n_voxel(out.n); k++) {
            const double p[3] = {(double)(k % out.n[0]) + 0.5, (double)(k / out.n[0] % out.n[1]) + 0.5,
                                 (double)(k / (out.n[0] * out.n[1])) + 0.5};
            peak = fmax(peak, fabs((double)out.density[k] - balls(p)));
        }
        if (!(peak < 0.05)) fail_msg("spacing %zu: off by up to %g", i, peak);
        volume_release(&v);
        volume_release(&out);
    }
}

static double polynomial(const double p[3])
{
    double z = 0.1 * (p[2] - 12.0), x = 0.1 * (p[0] - 6.0);
    return 1.0 + z * (1.0 + z * (-0.5 + z * (0.7 + z * (0.3 - 0.2 * z)))) + 0.3 * x * z + 0.1 * x * x * x;
}

static void test_polynomials_are_exact(void **state)
{
    (void)state;
    const size_t n[3] = {12, 12, 18};
    const double spacing[3] = {1.0, 1.0, 1.5};
    struct volume v = sampled(n, spacing, polynomial), out = cubes(&v);
    for (size_t k = 5; k + 5 < out.n[2]; k++)
        for (size_t i = 0; i < out.n[0]; i++) {
            const double p[3] = {(double)i + 0.5, 4.5, (double)k + 0.5};
            assert_true(fabs((double)out.density[volume_index(out.n, i, 4, k)] - polynomial(p)) < 1e-5);
        }
    volume_release(&v);
    volume_release(&out);
}

static void test_a_quarter_turn_is_exact(void **state)
{
    (void)state;
    const size_t n[3] = {24, 24, 40}, box[6] = {0, 0, 0, 24, 24, 40};
    const double spacing[3] = {1.0, 1.0, 1.0}, turn[9] = {0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0};
    struct volume v = sampled(n, spacing, balls), out;
    assert_int_equal(volume_resample(&v, turn, voxel_m, box, NULL, NULL, &out, NULL), STATUS_OK);
    for (size_t k = 0; k < 40; k++)
        for (size_t j = 0; j < 24; j++)
            for (size_t i = 0; i < 24; i++)
                assert_true(out.density[volume_index(n, 23 - j, i, k)] == v.density[volume_index(n, i, j, k)]);
    volume_release(&out);
    volume_release(&v);
}

/* A voxel that is not a number stays one, so that the scan is refused; what comes from outside is marked. */
static void test_bad_voxels_are_not_hidden(void **state)
{
    (void)state;
    const size_t n[3] = {16, 16, 16};
    const double spacing[3] = {1.0, 1.0, 1.5};
    const float bad[] = {NAN, INFINITY};
    for (int i = 0; i < 2; i++) {
        struct volume v = sampled(n, spacing, balls);
        v.density[volume_index(n, 8, 8, 8)] = bad[i];
        struct volume out = cubes(&v);
        float near = out.density[volume_index(out.n, 8, 8, 12)], far = out.density[volume_index(out.n, 2, 2, 2)];
        assert_true(isfinite(far) && (i == 0 ? isnan(near) : near == INFINITY));
        volume_release(&out);
        v.density[volume_index(n, 8, 8, 8)] = VOLUME_OUTSIDE;
        out = cubes(&v);
        assert_true(out.density[volume_index(out.n, 8, 8, 12)] == VOLUME_OUTSIDE);
        volume_release(&out);
        volume_release(&v);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_thick_slices_keep_their_places),
        cmocka_unit_test(test_polynomials_are_exact),
        cmocka_unit_test(test_a_quarter_turn_is_exact),
        cmocka_unit_test(test_bad_voxels_are_not_hidden),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
