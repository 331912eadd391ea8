/* The linear algebra of axis_fit.h: solves one banded system for each line. */
#ifndef SELVEDGE_GEOMETRY_AXIS_SOLVE_H
#define SELVEDGE_GEOMETRY_AXIS_SOLVE_H

#include "base/thread_pool.h"
#include "geometry/fibers/polyline.h"

/* Normal equations of the position of one vertex from the data. */
struct axis_equation {
    uint32_t segment;  /* segment that the terms belong to, in a sum over a brick */
    float normal[6];   /* xx, yx yy, zx zy zz */
    float gradient[3]; /* normal times the step to the minimum */
    /* Normal equation of the radius of the line, and its terms with the shared ones (axis_profile.h). */
    float radius_normal, radius_gradient, radius_cross[4];
};

/* Adds the terms of a position, and of the radius without the shared terms. */
void axis_equation_add(struct axis_equation *to, const struct axis_equation *from);
/* Mean information of the data on one component of the position of a vertex. */
double axis_information(const struct axis_equation *total, size_t n_vertex);

/* Standard deviation of one component of the lines' curvature, per voxel, at most AXIS_CURVATURE_MOST per diameter, the
 * curvature of fibers about to break. It is measured over chords of a diameter, where the noise of single vertices has
 * little weight. */
#define AXIS_CURVATURE_MOST 0.35
double axis_curvature_sd(const struct polyline_set *lines, double diameter);

/* Writes the stiffness at every vertex: `variance` of the residuals over the variance of the curvature there, which is
 * measured over four diameters of the line and weighed against the curvature of all lines (empirical Bayes). A cloth
 * whose fibers are straight in one part and sharply bent in another, such as a pile, has no curvature that is right for
 * both. The bounds are the same as in axis_curvature_sd. */
void axis_local_stiffness(const struct polyline_set *lines, double diameter, double variance, double *stiffness);

/* Correlation of a fiber's curvature between neighbouring vertices, from the length over which it is correlated. A
 * fiber has a bending stiffness, so its curvature changes little over a diameter; without that, noise would show as
 * bends. */
double axis_bend_correlation(double diameter);

/* Moves the vertices of every line to the minimum of its data terms plus the terms of its bends u_i, the second
 * differences times the root of the stiffness, by at most one voxel. The bends are a stationary sequence whose
 * neighbours have this correlation: u_1^2 + sum (u_{i+1} - correlation u_i)^2 / (1 - correlation^2). With 0 the terms
 * are stiffness |second difference|^2. stiffness: of each vertex. STATUS_NO_MEMORY. */
status axis_solve_lines(struct polyline_set *lines, const struct axis_equation *equation, const double *stiffness,
                        double correlation, struct thread_pool *pool, struct error *err);

#endif
