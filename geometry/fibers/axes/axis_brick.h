/* The sums of axis_fit.h over one brick of the scan: normal equations of the lines near its voxels. Lengths are in
 * voxels. */
#ifndef SELVEDGE_GEOMETRY_AXIS_BRICK_H
#define SELVEDGE_GEOMETRY_AXIS_BRICK_H

#include "geometry/fibers/axes/axis_model.h"
#include "geometry/fibers/axes/axis_solve.h"

#include <stdbool.h>

void axis_scratch_init(struct axis_scratch *s);
void axis_scratch_release(struct axis_scratch *s);

/* For the vertices of the brick's segments, and for the profile. */
struct axis_brick_sum {
    struct axis_equation *equation;   /* two for each segment of the brick, in the order of its list */
    struct section_equation *section; /* one for each segment; NULL for discs */
    struct lumen_equation *lumen;     /* one for each segment; NULL for solid fibers */
    struct shared_sum shared;
};

/* The caller frees the arrays of the sum. Returns false when memory is out. */
bool axis_brick_fit(const struct axis_model *model, size_t i_brick, struct axis_scratch *s, struct axis_brick_sum *sum);

#endif
