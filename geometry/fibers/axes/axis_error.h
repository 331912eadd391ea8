/* Standard errors of fitted axes (axis_fit.h).
 *
 * With data of information n a vertex, whose gradients have a variance of v n, and bends of penalty P(k)
 * (axis_solve.h), the posterior spectrum of the position is v / (n + P), and k^2 times that is the direction's. The
 * errors are the integrals over all wave numbers. v is measured (shape_measure.h), so that correlated noise counts as
 * it is, and n is the curvature of the sum that the fit minimises.
 *
 * Sharp bends are less correlated than P says. So directions have at least the error that they would have with
 * independent bends and voxels, n then being the normal equations' and v the variance of the residuals. */
#ifndef SELVEDGE_GEOMETRY_AXIS_ERROR_H
#define SELVEDGE_GEOMETRY_AXIS_ERROR_H

#include <stddef.h>

struct axis_data {
    double information; /* of one component at a vertex, of the normal equations */
    double slope;       /* share of it in the curvature */
    double residual;    /* variance of independent residuals */
    double noise;       /* v; at least the variance of the residuals counts */
    double correlation; /* of neighbouring bends */
};

/* Standard errors of a component of position (voxels) and direction: root mean squares over n vertices with these
 * stiffnesses. */
void axis_errors(const struct axis_data *data, const double *stiffness, size_t n, double *position_se,
                 double *direction_se_rad);

#endif
