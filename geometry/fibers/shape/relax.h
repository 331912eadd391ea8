/* Moves polylines onto the axes of their fibers in three dimensions, whatever subvolume they were found in.
 *
 * Every voxel of material belongs to the nearest polyline if that is within `reach`. The density-weighted mean
 * offset of a line's voxels from the line, perpendicular to it, is the error of the line. Vertices move by this
 * offset, averaged over neighbouring vertices, and the line is smoothed lightly. It converges in a few rounds.
 * Fibers that touch have their border midway between them, so neighbours do not shift each other. */
#ifndef SELVEDGE_GEOMETRY_RELAX_H
#define SELVEDGE_GEOMETRY_RELAX_H

#include "base/thread_pool.h"
#include "geometry/fibers/lines/polyline.h"
#include "geometry/volume/volume.h"

/* Moves the lines in place. reach_voxel: about 1.2 radii. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status polylines_relax(struct polyline_set *lines, const struct volume *v, float reach_voxel, int n_round,
                       double smooth_alpha, struct thread_pool *pool, const struct progress *progress,
                       struct error *err);

#endif
