/* The quadratic B-spline on nodes at whole numbers: distributes a value over three nodes, and interpolates between
 * them. */
#ifndef SELVEDGE_RENDERER_QUADRATIC_SPLINE_H
#define SELVEDGE_RENDERER_QUADRATIC_SPLINE_H

#include <math.h>
#include <stddef.h>

/* Weights of the three nodes about x, and their slopes when wanted. Returns the middle node. */
static inline int quadratic_spline(double x, double weight[3], double slope[3])
{
    const double middle = floor(x + 0.5), t = x - middle;
    weight[0] = 0.5 * (0.5 - t) * (0.5 - t);
    weight[1] = 0.75 - t * t;
    weight[2] = 0.5 * (0.5 + t) * (0.5 + t);
    if (slope != NULL) {
        slope[0] = t - 0.5;
        slope[1] = -2 * t;
        slope[2] = t + 0.5;
    }
    return (int)middle;
}

#endif
