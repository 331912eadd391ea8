/* The linear algebra of axis_fit.h: solves one banded system for each line. */
#ifndef SELVEDGE_GEOMETRY_AXIS_SOLVE_H
#define SELVEDGE_GEOMETRY_AXIS_SOLVE_H

#include "base/thread_pool.h"
#include "geometry/fibers/polyline.h"

/* Normal equations of the position of one vertex from the data. */
struct axis_equation {
    uint32_t segment;  /* in a sum over a brick: the segment whose terms these are */
    float normal[6];   /* xx, yx yy, zx zy zz */
    float gradient[3]; /* normal times the step to the minimum */
    /* Normal equation of the line's radius, and its cross terms with the parameters that all lines share
     * (axis_profile.h). */
    float radius_normal, radius_gradient, radius_cross[4];
};

/* Adds all terms of `from` to `to`, except radius_cross. */
void axis_equation_add(struct axis_equation *to, const struct axis_equation *from);
/* Returns the mean diagonal term of the normal equations of a position, the information that the data have on one
 * component. */
double axis_information(const struct axis_equation *total, size_t n_vertex);

/* Returns the standard deviation of one component of the lines' curvature, per voxel. It is at most AXIS_CURVATURE_MOST
 * per diameter, the curvature at which fibers are about to break. Curvature is measured over chords of one diameter, so
 * that the noise of single vertices has little weight. */
#define AXIS_CURVATURE_MOST 0.35
double axis_curvature_sd(const struct polyline_set *lines, double diameter);

/* Writes the stiffness at every vertex: the variance of the residuals, divided by the variance of the curvature there.
 * The variance of the curvature is measured along four diameters of the line and drawn towards the mean of all lines
 * (empirical Bayes). It is local because a pile, for example, is straight in one part and sharply bent in another. The
 * bounds are the same as in axis_curvature_sd. */
void axis_local_stiffness(const struct polyline_set *lines, double diameter, double variance, double *stiffness);

/* Returns the correlation of a fiber's curvature between neighbouring vertices. Fibers resist bending, so curvature
 * changes little over a diameter; a fit without this correlation would follow noise. */
double axis_bend_correlation(double diameter);

/* Moves the vertices of every line, by at most one voxel, to the minimum of its data terms plus the terms of its bends.
 * The bend u_i is the second difference at vertex i times the root of its stiffness. Bends are a stationary sequence
 * whose neighbours have the given correlation, so their terms are u_1^2 + sum (u_{i+1} - correlation u_i)^2 / (1 -
 * correlation^2); with correlation 0 these are stiffness |second difference|^2. stiffness: one value for each vertex.
 * STATUS_NO_MEMORY. */
status axis_solve_lines(struct polyline_set *lines, const struct axis_equation *equation, const double *stiffness,
                        double correlation, struct thread_pool *pool, struct error *err);

#endif
