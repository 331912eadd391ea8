/* The directions of fibers (geometry/filter/filter_directions.h) by slabs over the ranks: each filters its rows of
 * the volume, with a halo of those that have an effect on them, and the root gathers the rows. A helper holds about
 * 12 bytes for each voxel of its slab with the halo meanwhile. */
#ifndef SELVEDGE_GEOMETRY_DIRECTION_SHARE_H
#define SELVEDGE_GEOMETRY_DIRECTION_SHARE_H

#include "geometry/grade/reconstruct_option.h"
#include "geometry/volume/volume_slabs.h"

/* Data of an order RANK_ORDER_DIRECTIONS. */
struct directions_order {
    double diameter_voxel, s, t, eps_d, eps_j;
    uint64_t h;
};

/* Root: deals the volume out where that makes each rank's work much smaller; slabs->first is NULL otherwise.
 * STATUS_NO_MEMORY. */
status direction_share_deal(struct volume_slabs *slabs, const struct volume *v, double diameter_voxel,
                            const struct reconstruct_option *option, struct thread_pool *pool, struct error *err);
/* Root: filters the volume with all ranks; `d` is initialised here. STATUS_CANCELLED, STATUS_NO_MEMORY,
 * STATUS_DISK_FULL, STATUS_IO. */
status direction_share_filter(const struct volume_slabs *slabs, const struct volume *v, double diameter_voxel,
                              const struct reconstruct_option *option, struct thread_pool *pool,
                              const struct progress *progress, struct direction_volume *d, struct error *err);
/* Helper: filters its slab. STATUS_FORMAT, STATUS_NO_MEMORY, STATUS_CANCELLED, STATUS_IO. */
status direction_share_help(const struct helper_slab *slab, const struct rank_order *order, struct thread_pool *pool,
                            struct error *err);

#endif
