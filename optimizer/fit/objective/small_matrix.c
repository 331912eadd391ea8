#include "optimizer/fit/objective/small_matrix.h"
#include "renderer/scattering/scattering.h"

#include <math.h>
#include <string.h>

_Static_assert((int)SMALL_MATRIX_MAX >= (int)SCATTERING_MAX_PARAM, "matrices of a fit's unknowns fit");

static void rotate(double *m, double *v, size_t n, size_t p, size_t q)
{
    double apq = m[p * n + q];
    if (apq == 0.0) return;
    double theta = (m[q * n + q] - m[p * n + p]) / (2.0 * apq);
    double t = copysign(1.0, theta) / (fabs(theta) + sqrt(theta * theta + 1.0)), c = 1.0 / sqrt(t * t + 1.0), s = t * c;
    for (size_t k = 0; k < n; k++) {
        double kp = m[k * n + p], kq = m[k * n + q];
        m[k * n + p] = c * kp - s * kq;
        m[k * n + q] = s * kp + c * kq;
    }
    for (size_t k = 0; k < n; k++) {
        double pk = m[p * n + k], qk = m[q * n + k];
        m[p * n + k] = c * pk - s * qk;
        m[q * n + k] = s * pk + c * qk;
    }
    for (size_t k = 0; k < n; k++) {
        double kp = v[k * n + p], kq = v[k * n + q];
        v[k * n + p] = c * kp - s * kq;
        v[k * n + q] = s * kp + c * kq;
    }
}

void small_eigen(const double *a, size_t n, double *value, double *v)
{
    double m[SMALL_MATRIX_MAX * SMALL_MATRIX_MAX];
    memcpy(m, a, n * n * sizeof *m);
    memset(v, 0, n * n * sizeof *v);
    for (size_t i = 0; i < n; i++) v[i * n + i] = 1.0;
    for (int sweep = 0; sweep < 60; sweep++) {
        double off = 0.0, diagonal = 0.0;
        for (size_t p = 0; p < n; p++) {
            diagonal += m[p * n + p] * m[p * n + p];
            for (size_t q = p + 1; q < n; q++) off += m[p * n + q] * m[p * n + q];
        }
        if (off <= 1e-30 * diagonal) break;
        for (size_t p = 0; p + 1 < n; p++)
            for (size_t q = p + 1; q < n; q++) rotate(m, v, n, p, q);
    }
    for (size_t i = 0; i < n; i++) value[i] = m[i * n + i];
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

/* l: lower triangular factor of a. */
static bool factor(const double *a, size_t n, double *l)
{
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = a[i * n + j];
            for (size_t k = 0; k < j; k++) sum -= l[i * n + k] * l[j * n + k];
            if (i == j && !(sum > 0.0)) return false;
            l[i * n + j] = i == j ? sqrt(sum) : sum / l[j * n + j];
        }
    }
    return true;
}

bool small_invert(const double *a, size_t n, double *inverse)
{
    double l[SMALL_MATRIX_MAX * SMALL_MATRIX_MAX], y[SMALL_MATRIX_MAX];
    if (!factor(a, n, l)) return false;
    for (size_t column = 0; column < n; column++) {
        for (size_t i = 0; i < n; i++) {
            double sum = i == column ? 1.0 : 0.0;
            for (size_t k = 0; k < i; k++) sum -= l[i * n + k] * y[k];
            y[i] = sum / l[i * n + i];
        }
        for (size_t i = n; i-- > 0;) {
            double sum = y[i];
            for (size_t k = i + 1; k < n; k++) sum -= l[k * n + i] * inverse[k * n + column];
            inverse[i * n + column] = sum / l[i * n + i];
        }
    }
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
