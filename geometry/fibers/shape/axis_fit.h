/* Axes fitted to the scan: the polylines whose rendering comes nearest to the measured densities.
 *
 * Model: M(x) = low + (high - low) sum over lines of g(distance of x from the line), g(d) = erfc((d - r) / (sqrt 2 b)) / 2, the profile of a
 * fiber of radius r blurred by b. Fibers do not interpenetrate, so their blurred densities add up, and a line is not drawn to its
 * neighbours as it is to the centroid of what lies around it. Each round is one Gauss-Newton step of
 *     sum over voxels of w (V - M)^2 + sum over lines of stiffness |p_{i-1} - 2 p_i + p_{i+1}|^2
 * for all vertices, and one for r, b, low and high together; w (Geman and McClure 1985) takes no notice of fibers that no line stands for.
 * The stiffness is the variance of the residuals over that of the fibers' curvature, so noisy scans give smoother fibers.
 */
#ifndef SELVEDGE_GEOMETRY_AXIS_FIT_H
#define SELVEDGE_GEOMETRY_AXIS_FIT_H

#include "base/thread_pool.h"
#include "geometry/fibers/lines/polyline.h"
#include "geometry/volume/volume.h"

struct axis_profile {
    double radius, blur; /* voxels */
    double low, high;    /* densities of void and fiber */
};

/* lines (about one vertex a voxel; see polylines_resample) are moved, *profile is taken as the start and refined.
 * STATUS_CANCELLED, STATUS_NO_MEMORY. */
status polylines_fit(struct polyline_set *lines, const struct volume *v, double diameter_voxel, int n_round,
                     struct axis_profile *profile, struct thread_pool *pool, const struct progress *progress,
                     struct error *err);

/* Vertices one voxel apart along each line (the ends stay); out is initialised and empty. STATUS_NO_MEMORY. */
status polylines_resample(const struct polyline_set *lines, struct polyline_set *out, struct error *err);

#endif
