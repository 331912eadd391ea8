/* Standard errors of fitted axes (axis_fit.h).
 *
 * With data of information n a vertex, whose gradients have a variance of v n, and bends of penalty P(k)
 * (axis_solve.h), the posterior spectrum of the position is v / (n + P), and k^2 times that is the direction's. The
 * errors are the integrals over all wave numbers. v is measured (shape_measure.h), so that correlated noise counts as
 * it is. */
#ifndef SELVEDGE_GEOMETRY_AXIS_ERROR_H
#define SELVEDGE_GEOMETRY_AXIS_ERROR_H

#include <stddef.h>

struct axis_data {
    double information; /* of one component at a vertex: curvature of the sum that the fit minimises */
    double noise;       /* v */
    double correlation; /* of neighbouring bends */
};

/* Means of the variances of a component of position (voxels) and direction, over n vertices with these stiffnesses. */
void axis_errors(const struct axis_data *data, const double *stiffness, size_t n, double *position_se,
                 double *direction_se_rad);

#endif
