/* Directions of voxels by the lines near them (fabric thesis, section 5.6.7). */
#ifndef SELVEDGE_GEOMETRY_LINE_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_LINE_DIRECTIONS_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/volume/volume.h"

/* The changes, and the overlap of lines and kept voxels. */
struct line_directions {
    double angle_deg; /* sum over the changed voxels: between the direction before and after */
    size_t n_changed; /* voxels that have taken a direction */
    size_t n_fiber;   /* voxels in fibers; n_both: those that are kept as well */
    size_t n_both, n_kept;
};

/* Edge of the bricks, and the distance that they must reach, up to which voxels take the direction of a line. */
enum { LINE_DIRECTIONS_BRICK = 32 };
static inline float line_directions_reach(float radius_voxel) { return 2.0f * radius_voxel; }
/* Gives kept voxels (density > 0) within a diameter of a segment the direction of the nearest one. sum may be NULL. The
 * result does not depend on the number of threads. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status line_directions_give(const struct segment_bricks *bricks, struct direction_volume *d, struct thread_pool *pool,
                            const struct progress *progress, struct line_directions *sum, struct error *err);
/* Fills in the same sum and changes nothing. */
status line_directions_compare(const struct segment_bricks *bricks, struct direction_volume *d,
                               struct thread_pool *pool, const struct progress *progress, struct line_directions *sum,
                               struct error *err);

#endif
