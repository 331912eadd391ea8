/* Lowers the noise of a scan by a Gaussian blur. */
#ifndef SELVEDGE_GEOMETRY_NOISE_SMOOTHING_H
#define SELVEDGE_GEOMETRY_NOISE_SMOOTHING_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Standard deviation of the Gaussian in voxels, 0 for none, for noise of standard deviation scan_sd over the step from
 * void to material: the one that leaves a fifth of the step if the noise is white, but at most 0.7 voxels and a quarter
 * of the diameter's excess over 4 voxels. */
double noise_smoothing_sd(double scan_sd, double diameter_voxel);

/* Blurs v by a Gaussian of sd_voxel > 0; the values at the faces count on beyond them. The slices are processed in
 * order, with a few of them in memory besides v. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status volume_smooth_noise(struct volume *v, double sd_voxel, struct thread_pool *pool, struct error *err);

#endif
