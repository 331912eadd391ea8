/* Fibers as a density and direction volume: what a volume model of appearance sees of a cloth that was given as fibers.
 *
 * Density of a voxel: the share of it inside fibers, taken as clamp(1/2 + (r' - d) / w) of the distance d of its centre
 * from a fiber's axis, w its width; r'^2 = r^2 - w^2 / 12 keeps the area of the section, pi (r'^2 + w^2 / 12), as long as
 * the ramp ends before the axis (r' >= w / 2). Thinner fibers are drawn as wide as that, as cones of the fiber's area:
 * 3 r^2 / w^2 (1 - d / w). Narrower ones would slip between the centres of voxels; what is wider than the cloth is thick
 * goes to its first and last slice. Shares of different fibers add, up to 1. Ends are flat. Direction:
 * the tangent of the fiber whose axis is nearest, as in the direction transfer of the fabric thesis (5.6.7).
 *
 * The grid has a whole number of voxels in a tile, so it is periodic in x and y; its top is the
 * highest fiber's. Everything depends on the fibers and options only, not on the number of threads.
 */
#ifndef SELVEDGE_GEOMETRY_VOXELISE_H
#define SELVEDGE_GEOMETRY_VOXELISE_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

struct voxelise_option {
    double voxel_size_m; /* NaN: half of the mean radius, or as much more as the limit asks for */
    size_t limit_bytes;  /* of the volume: 5 bytes a voxel */
};

/* v: release it. *voxel_size_m: what was used (edges of voxels differ from it by the rounding to whole tiles). f must
 * satisfy fiber_set_validate. STATUS_TOO_LARGE (a given voxel size that needs more than the limit), STATUS_INVALID (one
 * wider than the tile), STATUS_NO_MEMORY, STATUS_CANCELLED. */
status fibers_voxelise(const struct fiber_set *f, const struct voxelise_option *o, struct thread_pool *pool,
                       const struct progress *progress, struct direction_volume *v, double *voxel_size_m,
                       struct error *err);

#endif
