/* The profile of the fibers in the fit of axes (axis_fit.h): the numbers that all fibers share, and the radius of
 * each. */
#ifndef SELVEDGE_GEOMETRY_AXIS_PROFILE_H
#define SELVEDGE_GEOMETRY_AXIS_PROFILE_H

#include "geometry/fibers/axes/model/fiber_section.h"

#include <stdbool.h>
#include <stddef.h>

struct shape_measure;

struct axis_profile {
    double blur;      /* voxels */
    double low, high; /* densities of void and fiber */
    /* The variance of the curvature is measured on the lines at every round. Otherwise it is the variance for fibers
     * about to break, which holds back no line that still has to find its fiber. */
    bool measured_curvature;
    /* Lines move little from round to round, so that the nearest segments of voxels serve several, unless a step
     * shows otherwise (nearest_rounds.h). */
    bool at_rest;
    struct fiber_section *section; /* of each vertex of the lines, refined too; NULL: discs */
    float *lumen;       /* with sections: area of each line's lumen over its outline's, refined too; NULL: solid */
    double damping;     /* of the steps of shared numbers and lumens; 0 for solid fibers */
    double clamp_sd;    /* with lumens: noise of the voxels before they were clamped to [0, 1]; 0: they were not */
    double model_error; /* with lumens: error of the fitted densities beside noise, for the stated errors; 0: none */
    struct shape_measure *measure; /* with sections: the last round leaves them with their errors in lines->shape */
    double independent; /* share of the voxels that have values of their own; below 1 where they are interpolated */
    /* Written by the fit: mean radius (voxels, by length), standard deviation of the fibers' radii without the part of
     * errors by white noise (relative), root mean square of the errors of single fibers (relative). */
    double radius, radius_spread, radius_se;
    /* Written by the fit: standard error of one component of the axes' position (voxels) and of their direction; by the
     * residuals, and by noise as measured where there is a measure. */
    double position_se, direction_se_rad;
};

enum { AXIS_N_TABLE = 512 };

/* Share of a blurred fiber in a voxel and its derivative, by the distance from the surface in units of the blur. */
struct axis_table {
    float scale;                      /* entries per unit */
    float entry[AXIS_N_TABLE + 2][2]; /* share and derivative */
};

/* A fiber is modelled up to AXIS_TAIL times the blur beyond its surface. */
#define AXIS_TAIL 2.5
/* Least radius of a fiber that a fit gives it, over the typical diameter. */
#define AXIS_RADIUS_LEAST 0.2
#define AXIS_CORE 3.5 /* depth below the surface at which a fiber is solid */

void axis_table_init(struct axis_table *t);

enum { AXIS_N_SHARED = 5 };

/* Normal equations of the numbers that all fibers share: a change of all radii, blur, low, high, and of the areas of
 * all lumens. */
struct shared_sum {
    double normal[AXIS_N_SHARED][AXIS_N_SHARED], gradient[AXIS_N_SHARED];
    double square, weight; /* of the residuals */
    double slope;          /* sum of the derivatives of weight times residual by the residual */
    double edge_slope;     /* the same weighted by the squared derivatives of the densities by all radii */
};

/* Normal equation of the radius of one line, and the terms that it has in common with the shared ones. */
struct radius_sum {
    double normal, gradient, cross[AXIS_N_SHARED];
    double scatter; /* variance of the gradient, from the scatter of pieces of the line */
    /* The same of the area of its lumen, and the term of both; 0 for solid fibers. */
    double area_normal, area_gradient, area_by_radius, area_cross[AXIS_N_SHARED];
};

/* Variance of the sum of n values about their mean, from that between pieces of `piece` values. Within a piece they may
 * be correlated in any way, as are the gradients of a radius: by the noise of the scan, by a radius that varies along
 * the fiber, and by neighbours that are not modelled. stride: of the values, in floats. Infinite below two pieces. */
double axis_scatter(const float *value, size_t stride, size_t n, size_t piece);

/* Return the curvature of the sum over the normal equations', because weights fall with the residuals: the mean, and at
 * the edges of fibers if that is smaller, as it is where void and solid are clamped. */
double axis_mean_slope(const struct shared_sum *shared);
double axis_edge_slope(const struct shared_sum *shared);

/* Makes one Gauss-Newton step for the numbers that all fibers share, and then one for the radius of each line with the
 * remaining residuals, limited to plausible values. (All at once overshoots: lines that touch share voxels, which the
 * equations of single lines do not know.) Radii are held towards their mean by their own spread (empirical Bayes), so
 * fibers of one size keep one size. length: of the lines. diameter: typical, voxels. */
void axis_profile_step(struct axis_profile *p, const struct shared_sum *shared, const struct radius_sum *line,
                       const double *length, size_t n_line, double diameter, float *radius);

#endif
