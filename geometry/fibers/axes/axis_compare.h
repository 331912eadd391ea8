/* The model of a brick beside the scan: residuals, their weights, and their terms for the numbers that all fibers
 * share. */
#ifndef SELVEDGE_GEOMETRY_AXIS_COMPARE_H
#define SELVEDGE_GEOMETRY_AXIS_COMPARE_H

#include "geometry/fibers/axes/axis_model.h"
#include "geometry/fibers/axes/axis_solve.h"

/* Compares the model with the n voxels of the scan from `from` on, and adds to the normal equations of the shared
 * numbers: a change of all radii, blur, low, high, and of all lumens. Shares above 1 become 1 where fibers are solid;
 * with lumens they stay, since they come from negative areas. Leaves weights and weighted residuals in s. */
void axis_compare(const struct axis_model *m, struct axis_scratch *s, const size_t from[3], const size_t n[3],
                  struct shared_sum *sum);

#endif
