/* The direction along which densities change least around a point: the eigenvector of the smallest eigenvalue of the
 * structure tensor sum_p w(p) grad L grad L^T (Bigun and Granlund 1987). Gradients are perpendicular to fibers
 * everywhere on their surfaces, so it works inside dense bundles of parallel fibers. Where fibers of two directions
 * meet within the window it mixes them. */
#ifndef SELVEDGE_GEOMETRY_STRUCTURE_TENSOR_H
#define SELVEDGE_GEOMETRY_STRUCTURE_TENSOR_H

#include "geometry/volume/volume.h"

enum { TENSOR_MAX_REACH = 24 };

struct tensor_window {
    int reach;                              /* voxels */
    float weight[2 * TENSOR_MAX_REACH + 1]; /* Gaussian along one axis */
};

/* Makes a Gaussian window of standard deviation sd_voxel, cut at 2 sd. */
void tensor_window_init(struct tensor_window *w, double sd_voxel);
/* Computes the direction at voxel (i, j, k) of a blurred volume. The window is cut at the faces. */
void structure_tensor_direction(const struct volume *blurred, const struct tensor_window *w, size_t i, size_t j,
                                size_t k, float d[3]);

#endif
