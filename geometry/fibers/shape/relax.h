/* Polylines moved onto the axes of their fibers in three dimensions, whatever subvolume they came from.
 *
 * Every voxel of material belongs to the nearest polyline, if that is within `reach`. The density-weighted mean offset of a line's voxels
 * from it, perpendicular to it, is the error of the line: vertices move by it (averaged over neighbouring vertices) and the line
 * is smoothed lightly. A few rounds settle it. Fibers that touch share their border, so neighbours do not pull.
 */
#ifndef SELVEDGE_GEOMETRY_RELAX_H
#define SELVEDGE_GEOMETRY_RELAX_H

#include "base/thread_pool.h"
#include "geometry/fibers/lines/polyline.h"
#include "geometry/volume/volume.h"

/* Lines in place. reach_voxel: about 1.2 radii. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status polylines_relax(struct polyline_set *lines, const struct volume *v, float reach_voxel, int n_round,
                       double smooth_alpha, struct thread_pool *pool, const struct progress *progress,
                       struct error *err);

#endif
