/* Converts fibers to a volume of densities and directions, for volume models of a cloth that was given as fibers.
 *
 * The density of a voxel is the share of it inside fibers. For a voxel of width w whose centre has distance d from
 * the axis of a fiber of radius r there (sections are discs) it is clamp(1/2 + (r' - d) / w), where r'^2 = r^2 -
 * w^2 / 12 preserves the area of the section, pi (r'^2 + w^2 / 12), if the ramp ends before the axis (r' >= w / 2).
 * Thinner fibers are drawn as cones of the width w and of the fiber's area, 3 r^2 / w^2 (1 - d / w), because narrower
 * profiles would miss the centres of voxels. Parts above or below the cloth are added to its first or last slice.
 * Shares of different fibers add, up to 1. Ends are flat. The direction is the tangent of the fiber whose axis is
 * nearest, as in the direction transfer of the fabric thesis (5.6.7).
 *
 * A tile has a whole number of voxels, so the grid is periodic in x and y. It ends at the top of the highest fiber. The
 * result depends only on the fibers and the options, not on the number of threads. */
#ifndef SELVEDGE_GEOMETRY_VOXELISE_H
#define SELVEDGE_GEOMETRY_VOXELISE_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

struct voxelise_option {
    double voxel_size_m; /* NaN: half of the mean radius, or the smallest size that the limit allows */
    size_t limit_bytes;  /* of the volume, 5 bytes per voxel */
};

/* The caller releases v. *voxel_size_m: size used; the edges of voxels differ from it by the rounding to whole
 * tiles. f must satisfy fiber_set_validate. STATUS_TOO_LARGE (a given voxel size needs more than the limit),
 * STATUS_INVALID (it is wider than the tile), STATUS_NO_MEMORY, STATUS_CANCELLED. */
status fibers_voxelise(const struct fiber_set *f, const struct voxelise_option *o, struct thread_pool *pool,
                       const struct progress *progress, struct direction_volume *v, double *voxel_size_m,
                       struct error *err);

#endif
