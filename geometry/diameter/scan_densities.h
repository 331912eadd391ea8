/* From the values of a scanner to densities in [0, 1].
 *
 * Clamping a noisy voxel loses a part of its information on its neighbourhood, and steps of the tracing that look at
 * few voxels (thresholds, centroids of disks, ways between ends) then fail. So a scan whose noise is strong is smoothed
 * before it is clamped. The fit of axes (axis_fit.h) finds the blur of the scan as it then is. */
#ifndef SELVEDGE_GEOMETRY_SCAN_DENSITIES_H
#define SELVEDGE_GEOMETRY_SCAN_DENSITIES_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* Noise as a standard deviation over the step from void to material. */
struct scan_noise {
    double scan_sd;      /* of the scan */
    double smooth_voxel; /* standard deviation of the Gaussian (noise_smoothing.h); 0: not smoothed */
    double mapped_sd;    /* of the densities */
    /* Diameter of fibers that noise hides in the scan, and the share of noise in their peak (fiber_diameter.h). NaN:
     * there are none, or none were looked for. */
    double hidden_diameter_voxel, hidden_noise_share;
};

/* Maps the values of v, low for void and high for material (density_map_apply, with its errors), and smooths them if
 * their noise is strong. diameter_voxel: of the fibers; NaN: it is measured if it matters. STATUS_CANCELLED,
 * STATUS_NO_MEMORY. */
status scan_densities_map(struct volume *v, double low, double high, double diameter_voxel, struct thread_pool *pool,
                          struct scan_noise *noise, struct error *err);

#endif
