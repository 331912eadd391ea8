/* Points along fibers in cells, to find the neighbours of a point. */
#ifndef SELVEDGE_GEOMETRY_GRADE_POINTS_H
#define SELVEDGE_GEOMETRY_GRADE_POINTS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

/* A point of a fiber, in voxels, and the unit direction there. */
struct grade_point {
    float p[3], t[3];
    uint32_t fiber;
};

struct grade_points {
    struct grade_point *point; /* in the order of the fibers */
    size_t n;
    size_t *first;  /* n_fiber + 1: the points of a fiber */
    double *radius; /* of the fibers, voxels */
    double cell, low[3];
    size_t n_cell[3];
    size_t *cell_first; /* counting sort by cell */
    uint32_t *in_cell;
};

/* Points a quarter of the fiber's diameter apart. reach: largest distance of a neighbour over the sum of the radii.
 * STATUS_NO_MEMORY; the caller releases also then. */
status grade_points_make(struct grade_points *g, const struct fiber_set *f, double voxel_m, double reach,
                         struct error *err);
void grade_points_release(struct grade_points *g);
/* The nearest point of another fiber that runs beside point i: at most 30 degrees from its direction, and between
 * `least` and `most` sums of the radii away, in the plane across the fiber. NULL if there is none. */
const struct grade_point *grade_points_beside(const struct grade_points *g, size_t i, double least, double most);

/* The fibers near point i, with the nearest point of each to it: the own one first, and at most n_most. reach: largest
 * distance of their surfaces, in voxels. Returns their number. */
size_t grade_points_near(const struct grade_points *g, size_t i, double reach, const struct grade_point **near,
                         size_t n_most);
/* Density at a place in voxels, between the centers of voxels; places beyond a face have the density of the face. */
double grade_density_at(const struct volume *v, const double x[3]);

#endif
