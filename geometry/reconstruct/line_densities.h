/* Densities of voxels by the fibers near them: the share of a voxel that they fill.
 *
 * A scan's own densities do not sum to the volume of its fibers. Voxels at the surface lie below the threshold, noise
 * and the bright rims of phase contrast are clamped at 1, and blur carries material out of the fibers. */
#ifndef SELVEDGE_GEOMETRY_LINE_DENSITIES_H
#define SELVEDGE_GEOMETRY_LINE_DENSITIES_H

#include "base/thread_pool.h"
#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/volume/volume.h"

struct line_densities {
    double radius_scale; /* of the radii of f */
    double halo_voxel;   /* distance from the surface up to which material is a fiber's own, blurred */
};

/* Distance from an axis that the bricks must reach, for radii of at most radius_voxel. */
float line_densities_reach(const struct line_densities *l, const struct fiber_set *f, float radius_voxel);
/* Gives voxels in fibers the share that the nearest fiber fills, at least 1 / 255, and those that were empty its
 * direction. Voxels of the halo that have a density get 1 / 255, and all others keep theirs. bricks: of f.
 * *sum_voxel: of the densities in fibers. The result does not depend on the number of threads. STATUS_CANCELLED,
 * STATUS_NO_MEMORY. */
status line_densities_give(const struct line_densities *l, const struct segment_bricks *bricks,
                           const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                           double *sum_voxel, struct error *err);

#endif
