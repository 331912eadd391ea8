/* Widths of the lobes of Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model for Production Path
 * Tracing", by roughnesses in (0, 1]. Along the fiber beta_M gives the standard deviation of R, 0.726 b + 0.812 b^2 +
 * 3.7 b^20 (equation 7 there, as a square); around it beta_N gives the scale of the logistic lobe, sqrt(pi / 8) (0.265
 * b + 1.194 b^2 + 5.372 b^22). Both in rad; *d is the derivative. */
#ifndef SELVEDGE_RENDERER_CHIANG_WIDTH_H
#define SELVEDGE_RENDERER_CHIANG_WIDTH_H

#include <math.h>

/* a b + c b^2 + e b^n and its derivative. */
static inline double chiang_width_polynomial(double b, const double factor[3], double n, double *d)
{
    *d = factor[0] + 2 * factor[1] * b + n * factor[2] * pow(b, n - 1);
    return factor[0] * b + factor[1] * b * b + factor[2] * pow(b, n);
}

static inline double chiang_width_along_rad(double beta_m, double *d)
{
    return chiang_width_polynomial(beta_m, (const double[3]){0.726, 0.812, 3.7}, 20, d);
}

static inline double chiang_width_around_rad(double beta_n, double *d)
{
    double width = chiang_width_polynomial(beta_n, (const double[3]){0.265, 1.194, 5.372}, 22, d);
    *d *= sqrt(M_PI / 8);
    return sqrt(M_PI / 8) * width;
}

#endif
