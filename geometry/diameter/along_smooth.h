/* Lowers the noise of a scan along its fibers, and leaves their sections as sharp as they are.
 *
 * It is meant for hollow fibers whose walls are thinner than two voxels: a blur across the walls would fill the lumen,
 * and without any blur noise makes holes in them. Along a fiber nothing changes within a few voxels. Each voxel becomes
 * a Gaussian mean along the direction of the structure tensor (structure_tensor.h); Weickert 1999, "Coherence-enhancing
 * diffusion filtering", does the same by diffusion. */
#ifndef SELVEDGE_GEOMETRY_ALONG_SMOOTH_H
#define SELVEDGE_GEOMETRY_ALONG_SMOOTH_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Writes `unit` times the smoothed density of each voxel. v: densities in [0, 1]. A copy of v is made meanwhile.
 * STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch space also STATUS_DISK_FULL. */
status density_smooth_along(const struct volume *v, struct thread_pool *pool, int unit, uint8_t *smooth,
                            struct error *err);

#endif
