#include "geometry/fibers/shape/smoothing.h"

/* The matrix is alpha I + D^T D, where D are the second differences: diagonal 1 5 6 ... 6 5 1, first off-diagonal -2
 * -4 ... -4 -2, second off-diagonal 1. */
static double diagonal(size_t i, size_t n)
{
    double d = 0.0;
    if (i >= 1 && i + 1 < n) d += 4.0;
    if (i >= 2) d += 1.0;
    if (i + 2 < n) d += 1.0;
    return d;
}

static double off_diagonal(size_t i, size_t n) /* between i and i + 1 */
{
    double d = 0.0;
    if (i >= 1) d -= 2.0;
    if (i + 2 < n) d -= 2.0;
    return d;
}

void polyline_smooth(float (*vertex)[3], size_t n, double alpha, double *work)
{
    if (n < 3) return;
    double *d = work, *l1 = work + n, *l2 = work + 2 * n,
           *y = work + 3 * n; /* L has unit diagonal, l1[i] = L[i][i-1], l2[i] = L[i][i-2] */
    for (size_t i = 0; i < n; i++) {
        l2[i] = i >= 2 ? 1.0 / d[i - 2] : 0.0;
        l1[i] = i >= 1 ? (off_diagonal(i - 1, n) - (i >= 2 ? l2[i] * l1[i - 1] * d[i - 2] : 0.0)) / d[i - 1] : 0.0;
        d[i] = alpha + diagonal(i, n) - (i >= 1 ? l1[i] * l1[i] * d[i - 1] : 0.0) -
               (i >= 2 ? l2[i] * l2[i] * d[i - 2] : 0.0);
    }
    for (int a = 0; a < 3; a++) {
        for (size_t i = 0; i < n; i++) /* forward: L y = alpha p0 */
            y[i] = alpha * (double)vertex[i][a] - (i >= 1 ? l1[i] * y[i - 1] : 0.0) - (i >= 2 ? l2[i] * y[i - 2] : 0.0);
        for (size_t i = n; i-- > 0;) { /* backward: L^T x = y / d */
            y[i] = y[i] / d[i] - (i + 1 < n ? l1[i + 1] * y[i + 1] : 0.0) - (i + 2 < n ? l2[i + 2] * y[i + 2] : 0.0);
            vertex[i][a] = (float)y[i];
        }
    }
}
