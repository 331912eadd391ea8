/* Linear algebra of small symmetric matrices against known answers. Matrices that are not definite are refused. */
#include "base/rng.h"
#include "base/small_matrix.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void assert_near(double value, double want, double tolerance)
{
    if (!(fabs(value - want) <= tolerance)) fail_msg("%.17g is not %.17g within %g", value, want, tolerance);
}

static void test_factor_and_solve(void **state)
{
    (void)state;
    /* 99: the upper triangle is not read */
    double m[9] = {4.0, 99.0, 99.0, 12.0, 37.0, 99.0, -16.0, -43.0, 98.0};
    const double factor[9] = {2.0, 99.0, 99.0, 6.0, 1.0, 99.0, -8.0, 5.0, 3.0};
    double x[6] = {-20.0, 4.0, -43.0, 12.0, 192.0, -16.0}; /* m (1, 2, 3) and m (1, 0, 0), stride 2 */
    assert_true(small_factor(m, 3, 0.0));
    for (int i = 0; i < 9; i++) assert_near(m[i], factor[i], 0.0);
    small_solve(m, 3, x, 2);
    small_solve(m, 3, x + 1, 2);
    const double want[6] = {1.0, 1.0, 2.0, 0.0, 3.0, 0.0};
    for (int i = 0; i < 6; i++) assert_near(x[i], want[i], 1e-11);
}

static void test_least_pivot(void **state)
{
    (void)state;
    double indefinite[4] = {1.0, 0.0, 2.0, 1.0}, small[4] = {1.0, 0.0, 0.0, 1e-10}, again[4], inverse[4];
    memcpy(again, small, sizeof small);
    assert_false(small_invert(indefinite, 2, inverse));
    assert_true(small_factor(small, 2, 0.0));
    assert_false(small_factor(again, 2, 1e-9));
}

/* The inverse of the Hilbert matrix has whole numbers. */
static void test_invert(void **state)
{
    (void)state;
    enum { N = 4 };
    const double want[N * N] = {16,  -120,  240,  -140,  -120, 1200, -2700, 1680,
                                240, -2700, 6480, -4200, -140, 1680, -4200, 2800};
    double hilbert[N * N], inverse[N * N], product[N * N];
    for (size_t i = 0; i < N * N; i++) hilbert[i] = 1.0 / (double)(i / N + i % N + 1);
    assert_true(small_invert(hilbert, N, inverse));
    small_multiply(hilbert, inverse, N, product);
    for (size_t i = 0; i < N * N; i++) {
        assert_near(inverse[i], want[i], 1e-8);
        assert_near(product[i], i % (N + 1) == 0 ? 1.0 : 0.0, 1e-11);
    }
}

/* -u'' = 1 on N points between two zeros: u_i = i (N + 1 - i) / 2. The band of 3 has the two diagonals and one of
 * zeros. */
static void test_banded(void **state)
{
    (void)state;
    enum { N = 40, BAND = 3 };
    double m[N * BAND] = {0}, x[N];
    for (size_t i = 0; i < N; i++) {
        m[i * BAND] = 2.0;
        m[i * BAND + 1] = -1.0; /* in row 0 this element is outside of the matrix and is not read */
        x[i] = 1.0;
    }
    assert_true(small_solve_banded(m, N, BAND, x));
    for (size_t i = 0; i < N; i++) assert_near(x[i], 0.5 * (double)((i + 1) * (N - i)), 1e-11);
    memset(m, 0, sizeof m);
    assert_false(small_solve_banded(m, N, BAND, x));
}

/* Systems of a band, of fewer rows than the band and of more. A dense solution of the same system has the same
 * unknowns. */
static void check_band(size_t band)
{
    enum { MOST = 23 };
    for (size_t n = 1; n <= MOST; n++) {
        double m[MOST * SMALL_BAND_MAX] = {0}, dense[MOST * MOST] = {0}, x[MOST], want[MOST];
        for (size_t i = 0; i < n; i++) {
            want[i] = x[i] = sin(1.0 + 3.0 * (double)i);
            for (size_t k = 0; k < band && k <= i; k++) {
                m[i * band + k] = k == 0 ? 4.0 + (double)(i % 3) : cos((double)(7 * i + k)) / (double)(k + 1);
                dense[i * n + i - k] = dense[(i - k) * n + i] = m[i * band + k];
            }
        }
        assert_true(small_factor(dense, n, 0.0));
        small_solve(dense, n, want, 1);
        assert_true(small_solve_banded(m, n, band, x));
        for (size_t i = 0; i < n; i++) assert_near(x[i], want[i], 1e-12);
        memset(m, 0, sizeof m);
        for (size_t i = 0; i < n; i++) m[i * band] = i + 1 < n ? 1.0 : -1.0;
        assert_false(small_solve_banded(m, n, band, x));
    }
}

/* Bands of 7 and 10 have loops of their own. */
static void test_bands(void **state)
{
    (void)state;
    check_band(7);
    check_band(10);
    check_band(4);
}

/* Eigenvalue j of the matrix with 2 on the diagonal and -1 beside it: 2 - 2 cos(j pi / (N + 1)). */
static void second_difference(double *a, size_t n)
{
    memset(a, 0, n * n * sizeof *a);
    for (size_t i = 0; i < n; i++) {
        a[i * n + i] = 2.0;
        if (i + 1 < n) a[i * n + i + 1] = a[(i + 1) * n + i] = -1.0;
    }
}

static void test_eigen(void **state)
{
    (void)state;
    enum { N = SMALL_MATRIX_MAX };
    double a[N * N], value[N], v[N * N];
    second_difference(a, N);
    small_eigen(a, N, value, v);
    for (size_t k = 0; k < N; k++) {
        size_t rank = 1;
        for (size_t i = 0; i < N; i++) rank += value[i] < value[k];
        assert_near(value[k], 2.0 - 2.0 * cos((double)rank * M_PI / (N + 1)), 1e-13);
        for (size_t i = 0; i < N; i++) {
            double av = 0.0;
            for (size_t j = 0; j < N; j++) av += a[i * N + j] * v[j * N + k];
            assert_near(av, value[k] * v[i * N + k], 1e-13);
        }
    }
}

static void test_eigen_3(void **state)
{
    (void)state;
    double m[3][3];
    float vector[3][3], value[3];
    second_difference(&m[0][0], 3);
    small_eigen_3(m, vector, value);
    for (int k = 0; k < 3; k++) {
        assert_near((double)value[k], 2.0 - 2.0 * cos((k + 1) * M_PI / 4), 1e-6);
        for (int i = 0; i < 3; i++) /* sin((i + 1)(k + 1) pi / 4) / sqrt 2, with either sign */
            assert_near(fabs((double)vector[k][i]), fabs(sin((i + 1) * (k + 1) * M_PI / 4)) / M_SQRT2, 1e-6);
    }
}

/* Random matrices: the inverse and the eigenvectors of definite ones, and indefinite ones made definite. */
static void test_random(void **state)
{
    (void)state;
    enum { N = 9 };
    struct rng_key key = {.seed = 11};
    struct rng r;
    double half[N * N], a[N * N] = {0}, inverse[N * N], product[N * N], value[N], v[N * N];
    rng_start(&r, &key, 0, 0);
    for (size_t i = 0; i < N * N; i++) half[i] = rng_double(&r) - 0.5;
    for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++)
            for (size_t k = 0; k < N; k++) a[i * N + j] += half[i * N + k] * half[j * N + k];
    assert_true(small_invert(a, N, inverse));
    small_multiply(a, inverse, N, product);
    for (size_t i = 0; i < N * N; i++) assert_near(product[i], i % (N + 1) == 0 ? 1.0 : 0.0, 1e-6);
    small_eigen(a, N, value, v);
    for (size_t k = 0; k < N; k++) assert_true(value[k] > 0.0);
    a[0] -= 5.0; /* indefinite now */
    assert_false(small_invert(a, N, inverse));
    small_clip_eigenvalues(a, N, 1e-3);
    small_eigen(a, N, value, v);
    for (size_t k = 0; k < N; k++) assert_true(value[k] > 0.9e-3);
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_factor_and_solve), cmocka_unit_test(test_least_pivot), cmocka_unit_test(test_invert),
        cmocka_unit_test(test_banded),           cmocka_unit_test(test_eigen),       cmocka_unit_test(test_eigen_3),
        cmocka_unit_test(test_random),           cmocka_unit_test(test_bands),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
