/* A square grid over the directions of a hemisphere: the octahedral map turned by 45 degrees (Cigolle et al. 2014,
 * "A Survey of Efficient Representations for Independent Unit Vectors", hemi-oct), whose edge is the horizon. Every
 * cell is about as large as any other. Square coordinates are in [0, 1]. */
#ifndef SELVEDGE_RENDERER_DIRECTION_GRID_H
#define SELVEDGE_RENDERER_DIRECTION_GRID_H

#include <math.h>
#include <stddef.h>

/* side 0: above, z >= 0; 1: below. */
static inline void direction_grid_direction(const double square[2], size_t side, double d[3])
{
    double p = 2.0 * square[0] - 1.0, q = 2.0 * square[1] - 1.0;
    d[0] = 0.5 * (p + q);
    d[1] = 0.5 * (p - q);
    d[2] = 1.0 - fabs(d[0]) - fabs(d[1]);
    double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int a = 0; a < 3; a++) d[a] /= side == 0 ? length : a == 2 ? -length : length;
}

static inline void direction_grid_square(const double d[3], double square[2])
{
    double sum = fabs(d[0]) + fabs(d[1]) + fabs(d[2]);
    square[0] = 0.5 + 0.5 * (d[0] + d[1]) / sum;
    square[1] = 0.5 + 0.5 * (d[0] - d[1]) / sum;
}

/* Writes the four cells around a direction and their bilinear weights. Beyond the middle of an outermost cell this cell
 * has all the weight. */
static inline void direction_grid_cells(const double d[3], size_t edge, size_t cell[4], double weight[4])
{
    double square[2], part[2];
    size_t at[2][2];
    direction_grid_square(d, square);
    for (int a = 0; a < 2; a++) {
        double x = fmin(fmax(square[a] * (double)edge - 0.5, 0.0), (double)edge - 1.0);
        at[a][0] = (size_t)x;
        at[a][1] = at[a][0] + 1 < edge ? at[a][0] + 1 : at[a][0];
        part[a] = x - (double)at[a][0];
    }
    for (int k = 0; k < 4; k++) {
        cell[k] = (d[2] < 0.0 ? edge * edge : 0) + at[1][k >> 1] * edge + at[0][k & 1];
        weight[k] = ((k & 1) ? part[0] : 1.0 - part[0]) * ((k >> 1) ? part[1] : 1.0 - part[1]);
    }
}

#endif
