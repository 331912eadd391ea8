/* Errors of smoothed axes, by the spectrum of what is left of the noise (fibers/shape/axes/axis_fit.h). */
#ifndef SELVEDGE_GEOMETRY_AXIS_ERROR_H
#define SELVEDGE_GEOMETRY_AXIS_ERROR_H

enum { AXIS_N_ERROR = 801 };

/* Variances of one component of the position (voxels) and of the direction (radians) over that of the position of a
 * vertex alone, at even steps of the logarithm of the information over the stiffness. */
struct axis_errors {
    double variance[AXIS_N_ERROR][2];
};

/* correlation: of the bends of neighbouring vertices (axis_solve.h). */
void axis_errors_init(struct axis_errors *e, double correlation);
/* Adds the variances at a vertex. ratio: information about its position over the stiffness there. */
void axis_errors_add(const struct axis_errors *e, double ratio, double variance[2]);

#endif
