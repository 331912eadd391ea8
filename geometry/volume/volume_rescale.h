/* A volume, and its directions, in voxels of another size. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_RESCALE_H
#define SELVEDGE_GEOMETRY_VOLUME_RESCALE_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Makes `out` of voxels whose edge is `edge` times the edge of v's voxels; both have the same corner. edge > 1: each
 * density is the mean over the voxel, exactly, and the last voxel along an axis may be a part of one. edge < 1:
 * interpolated by six points along each axis (volume_align.h). Uses the scratch space of v. STATUS_CANCELLED, and as
 * volume_init_in. */
status volume_rescale(const struct volume *v, double edge, struct thread_pool *pool, const struct progress *progress,
                      struct volume *out, struct error *err);

/* The same for a volume that volume_rescale has made from v with this edge, whose densities were changed since then: it
 * gets the same ones again. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status volume_rescale_again(const struct volume *v, double edge, struct thread_pool *pool,
                            const struct progress *progress, struct volume *out, struct error *err);

/* Makes `out` with the grid and the densities of v. Each voxel takes the direction of the voxel of `from` that holds
 * its centre; if this one is empty, the direction of a voxel of `from` whose centre it holds. A voxel is empty below
 * eps_d, and where the voxels of `from` are. *n_material: voxels of eps_d and more; *n_kept: voxels that are not empty.
 * STATUS_CANCELLED, and as volume_init_in. */
status direction_volume_rescale(const struct direction_volume *from, const struct volume *v, double eps_d,
                                struct thread_pool *pool, struct direction_volume *out, size_t *n_material,
                                size_t *n_kept, struct error *err);
/* The same for voxels that are no larger than those of `from`, whose directions stand for theirs (kept_directions.h):
 * `from` must outlive `out`. */
status direction_volume_refine(const struct direction_volume *from, const struct volume *v, double eps_d,
                               struct thread_pool *pool, struct direction_volume *out, struct error *err);

#endif
