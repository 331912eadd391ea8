/* Spherical harmonics: orthonormal, equal to closed forms, rotated as the function is; zonal coefficients of Gaussians.
 */
#include "base/rng.h"
#include "renderer/fast/sphere_harmonics.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static void random_direction(struct rng *r, float d[3])
{
    double z = 2 * rng_double(r) - 1, phi = 2 * M_PI * rng_double(r), s = sqrt(1 - z * z);
    d[0] = (float)(s * cos(phi));
    d[1] = (float)(s * sin(phi));
    d[2] = (float)z;
}

/* A frame of right angles from two random directions. */
static void random_frame(struct rng *r, float row[3][3])
{
    float other[3];
    random_direction(r, row[2]);
    random_direction(r, other);
    double along = 0, length2 = 0;
    for (int a = 0; a < 3; a++) along += (double)(other[a] * row[2][a]);
    for (int a = 0; a < 3; a++) {
        row[0][a] = other[a] - (float)along * row[2][a];
        length2 += (double)(row[0][a] * row[0][a]);
    }
    for (int a = 0; a < 3; a++) row[0][a] /= (float)sqrt(length2);
    for (int a = 0; a < 3; a++)
        row[1][a] = row[2][(a + 1) % 3] * row[0][(a + 2) % 3] - row[2][(a + 2) % 3] * row[0][(a + 1) % 3];
}

/* Products of all pairs, summed over Gauss-Legendre points in z (exact up to degree 15) and 16 azimuths. */
static void orthonormal(void **state)
{
    (void)state;
    static const double z[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    static const double weight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    double sum[SPHERE_MAX_COUNT][SPHERE_MAX_COUNT] = {{0}};
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 16; k++) {
            double c = i < 4 ? z[i] : -z[i - 4], s = sqrt(1 - c * c), phi = 2 * M_PI * (k + 0.3) / 16;
            const float d[3] = {(float)(s * cos(phi)), (float)(s * sin(phi)), (float)c};
            float y[SPHERE_MAX_COUNT];
            sphere_harmonics(SPHERE_MAX_ORDER, d, y);
            for (int a = 0; a < SPHERE_MAX_COUNT; a++)
                for (int b = 0; b < SPHERE_MAX_COUNT; b++)
                    sum[a][b] += (double)y[a] * (double)y[b] * weight[i % 4] * 2 * M_PI / 16;
        }
    for (int a = 0; a < SPHERE_MAX_COUNT; a++)
        for (int b = 0; b < SPHERE_MAX_COUNT; b++) assert_true(fabs(sum[a][b] - (a == b)) < 2e-6);
}

static void closed_forms(void **state)
{
    (void)state;
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = 1}, 0, 0);
    for (int i = 0; i < 50; i++) {
        float d[3], y[SPHERE_MAX_COUNT];
        random_direction(&r, d);
        sphere_harmonics(3, d, y);
        double x = (double)d[0], yy = (double)d[1], z = (double)d[2];
        const double expected[9] = {sqrt(0.25 / M_PI),
                                    sqrt(0.75 / M_PI) * yy,
                                    sqrt(0.75 / M_PI) * z,
                                    sqrt(0.75 / M_PI) * x,
                                    0.5 * sqrt(15 / M_PI) * x * yy,
                                    0.5 * sqrt(15 / M_PI) * yy * z,
                                    0.25 * sqrt(5 / M_PI) * (3 * z * z - 1),
                                    0.5 * sqrt(15 / M_PI) * x * z,
                                    0.25 * sqrt(15 / M_PI) * (x * x - yy * yy)};
        for (int k = 0; k < 9; k++) assert_true(fabs((double)y[k] - expected[k]) < 1e-6);
        assert_true(fabs((double)y[15] - 0.25 * sqrt(35 / (2 * M_PI)) * x * (x * x - 3 * yy * yy)) < 1e-6);
    }
}

/* A function of random coefficients, and the same by its rotated coefficients at the direction in the new frame. */
static void rotated_function(void **state)
{
    (void)state;
    struct rng r;
    rng_start(&r, &(struct rng_key){.seed = 2}, 0, 0);
    for (int i = 0; i < 100; i++) {
        float row[3][3], c[2 * SPHERE_MAX_COUNT], turned[2 * SPHERE_MAX_COUNT], rotation[SPHERE_MAX_ROTATION];
        size_t order = (size_t)i % (SPHERE_MAX_ORDER + 1), n = sphere_count(order);
        random_frame(&r, row);
        for (size_t k = 0; k < 2 * n; k++) c[k] = rng_float(&r) - 0.5f;
        sphere_rotation(order, (const float(*)[3])row, rotation);
        sphere_rotate(order, rotation, c, 2, turned);
        for (int j = 0; j < 5; j++) {
            float d[3], in_frame[3], y[SPHERE_MAX_COUNT], y_frame[SPHERE_MAX_COUNT];
            random_direction(&r, d);
            for (int a = 0; a < 3; a++) in_frame[a] = row[a][0] * d[0] + row[a][1] * d[1] + row[a][2] * d[2];
            sphere_harmonics(order, d, y);
            sphere_harmonics(order, in_frame, y_frame);
            for (size_t channel = 0; channel < 2; channel++) {
                double before = 0, after = 0;
                for (size_t k = 0; k < n; k++) {
                    before += (double)(c[channel * n + k] * y[k]);
                    after += (double)(turned[channel * n + k] * y_frame[k]);
                }
                assert_true(fabs(before - after) < 2e-5);
            }
        }
    }
}

/* Coefficients of order 0 and 1 of exp(k (cos - 1)) in closed form: the mean cosine is coth k - 1 / k. */
static void gaussian_zonal(void **state)
{
    (void)state;
    static const double sharpness[] = {0, 0.01, 1, 10, 128, 5000};
    for (size_t i = 0; i < sizeof sharpness / sizeof *sharpness; i++) {
        float z[SPHERE_MAX_ORDER + 1];
        double k = sharpness[i], mean = k > 0 ? 1 / tanh(k) - 1 / k : 0;
        sphere_gaussian_zonal(SPHERE_MAX_ORDER, k, z);
        assert_true(fabs((double)z[0] - sqrt(0.25 / M_PI)) < 1e-6);
        assert_true(fabs((double)z[1] - sqrt(0.75 / M_PI) * mean) < 2e-6);
        double p2 = k > 0 ? 1 - 3 * mean / k : 0; /* the mean of P_2 */
        if (k != 0.01) assert_true(fabs((double)z[2] - sqrt(1.25 / M_PI) * p2) < 2e-6);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(orthonormal),
        cmocka_unit_test(closed_forms),
        cmocka_unit_test(rotated_function),
        cmocka_unit_test(gaussian_zonal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
