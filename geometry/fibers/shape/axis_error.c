#include "geometry/fibers/shape/axis_error.h"

#include <math.h>

enum { N_NODE = 256 };
static const double LEAST = -30.0, STEP = 0.05; /* logarithms of the ratio */

/* The integrals of 1 / (n + P) and k^2 / (n + P) over the wave numbers k / (2 pi), times n, for n over the stiffness of
 * `ratio`: P = stiffness k^4 ((1 - c)^2 + c k^2) / (1 - c^2) is the spectrum of the terms of bends with a correlation
 * c. */
static void integrate(double ratio, double c, double variance[2])
{
    const double scaled = ratio * (1.0 - c * c), square = (1.0 - c) * (1.0 - c);
    double middle = pow(scaled / square, 0.25); /* where P begins to exceed n */
    if (c > 0.0) middle = fmin(middle, pow(scaled / c, 1.0 / 6.0));
    variance[0] = variance[1] = 0.0;
    for (int i = 0; i < N_NODE; i++) {
        const double u = (i + 0.5) / N_NODE, k = middle * u / (1.0 - u), k2 = k * k;
        const double weight = middle / ((1.0 - u) * (1.0 - u) * N_NODE * M_PI);
        const double left = weight / (1.0 + k2 * k2 * (square + c * k2) / scaled);
        variance[0] += left;
        variance[1] += left * k2;
    }
}

void axis_errors_init(struct axis_errors *e, double correlation)
{
    for (int i = 0; i < AXIS_N_ERROR; i++) integrate(exp(LEAST + STEP * i), correlation, e->variance[i]);
}

void axis_errors_add(const struct axis_errors *e, double ratio, double variance[2])
{
    const double at = fmin(fmax((log(ratio) - LEAST) / STEP, 0.0), AXIS_N_ERROR - 1.001);
    const int i = (int)at;
    for (int m = 0; m < 2; m++)
        variance[m] += e->variance[i][m] + (at - i) * (e->variance[i + 1][m] - e->variance[i][m]);
}
