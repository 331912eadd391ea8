/* Tells lumens from the gaps between fibers among the basins that were filled (lumen_fill.h), and fills lumens whole.
 *
 * A filled lumen is the middle of a fiber, and a filled gap is not: there the scale-normalised Laplacian of the filled
 * scan at the scale of the fibers (Lindeberg 1998) has a ridge and a saddle. Noise and neighbours hide this at a single
 * voxel, but the mean over a whole basin shows it: a basin is as long as its fiber within the scan. Basins with too
 * small a mean are emptied. That is done twice, because filled gaps lower the response of the lumens beside them. The
 * remaining lumens are then enlarged by one voxel, because at the rim a lumen is too shallow to count as a basin. */
#ifndef SELVEDGE_GEOMETRY_LUMEN_FILTER_H
#define SELVEDGE_GEOMETRY_LUMEN_FILTER_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* v: with v->filled of lumens_fill. diameter_voxel: of the fibers, as measured in v. *filled_share: the share of
 * lumens_fill, lowered to the voxels that stay filled. STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch space also
 * STATUS_DISK_FULL. */
status lumens_filter(struct volume *v, double diameter_voxel, struct thread_pool *pool, double *filled_share,
                     struct error *err);

#endif
