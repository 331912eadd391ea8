/* The step of the section that fibers fill at a seam (fiber_seam.h). */
#ifndef SELVEDGE_GEOMETRY_SEAM_STEP_H
#define SELVEDGE_GEOMETRY_SEAM_STEP_H

#include "geometry/fibers/fiber_set.h"

/* *step: of the seam across axis 0 (x) or 1 (y). *inside: its mean at planes within the tile. STATUS_NO_MEMORY. */
status seam_step_measure(const struct fiber_set *f, int axis, double *step, double *inside, struct error *err);

#endif
