/* Measures a seam (fiber_seam.h): the step in the area of fiber sections from one side of it to the other. */
#ifndef SELVEDGE_GEOMETRY_SEAM_STEP_H
#define SELVEDGE_GEOMETRY_SEAM_STEP_H

#include "geometry/fibers/fiber_set.h"

/* *step: the step at the seam across axis 0 (x) or 1 (y). *inside: the mean step at planes within the tile, to compare
 * with. STATUS_NO_MEMORY. */
status seam_step_measure(const struct fiber_set *f, int axis, double *step, double *inside, struct error *err);

#endif
