/* How far the voxels of a scan lie from the traced fibers: a byte for each voxel. */
#ifndef SELVEDGE_GEOMETRY_LINE_DISTANCE_H
#define SELVEDGE_GEOMETRY_LINE_DISTANCE_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

/* LINE_INSIDE + kind: within the surface of a fiber of this kind. Larger codes are distances from the nearest surface,
 * (code - LINE_OUTSIDE) / LINE_PER_VOXEL voxels, up to LINE_FAR, which stands for all larger ones. LINE_UNKNOWN: the
 * voxel was not measured. */
enum { LINE_INSIDE = 0, LINE_KINDS = 2, LINE_OUTSIDE = LINE_KINDS, LINE_PER_VOXEL = 50, LINE_FAR = 254, LINE_UNKNOWN };

/* Writes the codes of all voxels of v. kind: of each fiber, below LINE_KINDS; where fibers overlap, the lower kind
 * counts. Sections of two axes are ellipses. The result does not depend on the threads. STATUS_CANCELLED. */
status line_distance_map(const struct volume *v, const struct fiber_set *f, const uint8_t *kind,
                         struct thread_pool *pool, uint8_t *code, struct error *err);

static inline double line_distance_voxel(uint8_t code)
{
    return code < LINE_OUTSIDE ? 0.0 : (double)(code - LINE_OUTSIDE) / LINE_PER_VOXEL;
}

#endif
