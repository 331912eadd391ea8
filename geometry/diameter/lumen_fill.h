/* Fills the lumens of hollow fibers, so that a hollow fiber is traced as the solid one of its outline.
 *
 * A lumen is void that no way through void connects with the outside. Let g be the density, smoothed along the fibers
 * to lower its noise without blurring thin walls (along_smooth.h), and f(x) the smallest possible maximum of g over the
 * ways from x to the outside (the reconstruction of g by erosion, Vincent 1993). f - g is the depth of the basin that x
 * lies in; at the faces of the scan, where fibers are cut, ways end. Basins deeper than the noise are filled. Enclosed
 * gaps between fibers are basins too; lumen_filter.h empties most of them again, in scans of fibers known to be hollow.
 */
#ifndef SELVEDGE_GEOMETRY_LUMEN_FILL_H
#define SELVEDGE_GEOMETRY_LUMEN_FILL_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Sets the density in lumens to 1, and saves their former densities in v->filled. v: densities in [0, 1]. noise_sd: of
 * a voxel. *filled_share: filled voxels over material voxels. STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch space
 * also STATUS_DISK_FULL. */
status lumens_fill(struct volume *v, double noise_sd, struct thread_pool *pool, double *filled_share,
                   struct error *err);

#endif
