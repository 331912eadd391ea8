#include "base/small_matrix.h"

#include <math.h>
#include <string.h>

bool small_factor(double *m, size_t n, double least_pivot)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = m[i * n + j];
            for (size_t k = 0; k < j; k++) sum -= m[i * n + k] * m[j * n + k];
            if (i == j && !(sum > least_pivot)) return false;
            m[i * n + j] = i == j ? sqrt(sum) : sum / m[j * n + j];
        }
    }
    return true;
}

void small_solve(const double *factor, size_t n, double *x, size_t stride)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++) x[i * stride] -= factor[i * n + k] * x[k * stride];
        x[i * stride] /= factor[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++) x[i * stride] -= factor[k * n + i] * x[k * stride];
        x[i * stride] /= factor[i * n + i];
    }
}

/* Row i of a band matrix and of its factor, with n_before columns before the diagonal. inverse[d]: the reciprocal of
 * the factor's diagonal d rows before. Inlined with constant sizes, so that its loops are unrolled. */
static inline bool factor_row(double *row, size_t n_band, size_t n_before, double *inverse)
{
    for (size_t d = n_before; d > 0; d--) {
        const double *other = row - d * n_band;
        double sum = row[d];
        for (size_t k = n_before; k > d; k--) sum -= row[k] * other[k - d];
        row[d] = sum * inverse[d];
    }
    double sum = row[0];
    for (size_t k = n_before; k > 0; k--) sum -= row[k] * row[k];
    if (!(sum > 0.0)) return false;
    row[0] = sqrt(sum);
    for (size_t d = n_band - 1; d > 1; d--) inverse[d] = inverse[d - 1];
    inverse[1] = 1.0 / row[0];
    return true;
}

/* The band of second differences of points in space, which most systems have, and of differences of these. */
enum { BAND_OF_POINTS = 7, BAND_OF_BENDS = 10 };

static bool factor_banded(double *m, size_t n, size_t n_band)
{
    double inverse[SMALL_BAND_MAX + 1] = {0.0};
    size_t i = 0;
    for (; i < n && i + 1 < n_band; i++)
        if (!factor_row(m + i * n_band, n_band, i, inverse)) return false;
    if (n_band == BAND_OF_POINTS) {
        for (; i < n; i++)
            if (!factor_row(m + i * BAND_OF_POINTS, BAND_OF_POINTS, BAND_OF_POINTS - 1, inverse)) return false;
    }
    if (n_band == BAND_OF_BENDS) {
        for (; i < n; i++)
            if (!factor_row(m + i * BAND_OF_BENDS, BAND_OF_BENDS, BAND_OF_BENDS - 1, inverse)) return false;
    }
    for (; i < n; i++)
        if (!factor_row(m + i * n_band, n_band, n_band - 1, inverse)) return false;
    return true;
}

bool small_solve_banded(double *m, size_t n, size_t n_band, double *x)
{
    if (!factor_banded(m, n, n_band)) return false;
    /* the unknown found last comes last into the sums, so that the others do not wait for it */
    for (size_t i = 0; i < n; i++) {
        double sum = x[i];
        for (size_t k = i < n_band - 1 ? i : n_band - 1; k > 0; k--) sum -= m[i * n_band + k] * x[i - k];
        x[i] = sum / m[i * n_band];
    }
    for (size_t i = n; i-- > 0;) {
        double sum = x[i];
        for (size_t k = n - 1 - i < n_band - 1 ? n - 1 - i : n_band - 1; k > 0; k--)
            sum -= m[(i + k) * n_band + k] * x[i + k];
        x[i] = sum / m[i * n_band];
    }
    return true;
}

bool small_invert_banded(double *m, size_t n, size_t n_band)
{
    if (!factor_banded(m, n, n_band)) return false;
    for (size_t j = n; j-- > 0;) { /* columns above j hold the inverse already */
        double l[SMALL_BAND_MAX];  /* column j of the factor from the diagonal on */
        const size_t below = n - 1 - j < n_band - 1 ? n - 1 - j : n_band - 1;
        for (size_t k = 0; k <= below; k++) l[k] = m[(j + k) * n_band + k];
        for (size_t i = below + 1; i-- > 0;) {
            double sum = i == 0 ? 1.0 / l[0] : 0.0;
            for (size_t k = 1; k <= below; k++) {
                const size_t low = i < k ? i : k, high = i < k ? k : i;
                sum -= l[k] * m[(j + high) * n_band + high - low];
            }
            m[(j + i) * n_band + i] = sum / l[0];
        }
    }
    return true;
}

bool small_invert(const double *a, size_t n, double *inverse)
{
    double factor[SMALL_MATRIX_MAX * SMALL_MATRIX_MAX];
    memcpy(factor, a, n * n * sizeof *factor);
    if (!small_factor(factor, n, 0.0)) return false;
    for (size_t i = 0; i < n * n; i++) inverse[i] = i % (n + 1) == 0 ? 1.0 : 0.0;
    for (size_t column = 0; column < n; column++) small_solve(factor, n, inverse + column, n);
    return true;
}

void small_multiply(const double *a, const double *b, size_t n, double *out)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            double sum = 0.0;
            for (size_t k = 0; k < n; k++) sum += a[i * n + k] * b[k * n + j];
            out[i * n + j] = sum;
        }
    }
}

/* (a, b) <- (c a - s b, s a + c b) for n pairs that lie `step` apart. */
static inline void rotate_pairs(double *a, double *b, size_t n, size_t step, double c, double s)
{
    for (size_t k = 0; k < n * step; k += step) {
        double ak = a[k], bk = b[k];
        a[k] = c * ak - s * bk;
        b[k] = s * ak + c * bk;
    }
}

/* The Jacobi rotation that makes m[p][q], which is not 0, vanish, applied to m and to the eigenvectors v. */
static inline void rotate(double *m, double *v, size_t n, size_t p, size_t q)
{
    double theta = 0.5 * (m[q * n + q] - m[p * n + p]) / m[p * n + q];
    double t = copysign(1.0, theta) / (fabs(theta) + sqrt(theta * theta + 1.0)), c = 1.0 / sqrt(t * t + 1.0), s = t * c;
    rotate_pairs(m + p, m + q, n, n, c, s);
    rotate_pairs(m + p * n, m + q * n, n, 1, c, s);
    rotate_pairs(v + p, v + q, n, n, c, s);
}

void small_eigen(const double *a, size_t n, double *value, double *v)
{
    double m[SMALL_MATRIX_MAX * SMALL_MATRIX_MAX];
    memcpy(m, a, n * n * sizeof *m);
    for (size_t i = 0; i < n * n; i++) v[i] = i % (n + 1) == 0 ? 1.0 : 0.0;
    for (int sweep = 0; sweep < 60; sweep++) {
        double off = 0.0, diagonal = 0.0;
        for (size_t p = 0; p < n; p++) {
            diagonal += m[p * n + p] * m[p * n + p];
            for (size_t q = p + 1; q < n; q++) off += m[p * n + q] * m[p * n + q];
        }
        if (off <= 1e-30 * diagonal) break;
        for (size_t p = 0; p + 1 < n; p++)
            for (size_t q = p + 1; q < n; q++)
                if (m[p * n + q] != 0.0) rotate(m, v, n, p, q);
    }
    for (size_t i = 0; i < n; i++) value[i] = m[i * n + i];
}

/* m becomes diagonal; the columns of e are its eigenvectors. */
static void diagonalise_3(double m[3][3], double e[3][3])
{
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) e[a][b] = a == b ? 1.0 : 0.0;
    for (int sweep = 0; sweep < 12; sweep++)
        for (size_t p = 0; p < 2; p++)
            for (size_t q = p + 1; q < 3; q++)
                if (!(fabs(m[p][q]) <= 1e-14 * (fabs(m[p][p]) + fabs(m[q][q])))) rotate(&m[0][0], &e[0][0], 3, p, q);
}

void small_eigen_3(double m[3][3], float vector[3][3], float value[3])
{
    double e[3][3];
    int order[3] = {0, 1, 2};
    diagonalise_3(m, e);
    for (int a = 0; a < 2; a++)
        for (int b = 0; b < 2 - a; b++)
            if (m[order[b]][order[b]] > m[order[b + 1]][order[b + 1]]) {
                int t = order[b];
                order[b] = order[b + 1];
                order[b + 1] = t;
            }
    for (int k = 0; k < 3; k++) {
        value[k] = (float)m[order[k]][order[k]];
        for (int a = 0; a < 3; a++) vector[k][a] = (float)e[a][order[k]];
    }
}

void small_clip_eigenvalues(double *a, size_t n, double floor)
{
    double value[SMALL_MATRIX_MAX], v[SMALL_MATRIX_MAX * SMALL_MATRIX_MAX];
    small_eigen(a, n, value, v);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = 0.0;
            for (size_t k = 0; k < n; k++) sum += v[i * n + k] * fmax(value[k], floor) * v[j * n + k];
            a[i * n + j] = a[j * n + i] = sum;
        }
    }
}
