/* Fits fiber axes to the scan: finds the polylines whose rendering is nearest to the measured densities.
 *
 * Model: M(x) = low + (high - low) sum over lines of g(distance of x from the line), where g(d) = erfc((d - r) /
 * (sqrt 2 b)) / 2 is the profile of a fiber of radius r, blurred by b; every line has its own r. Fibers do not
 * interpenetrate, so their blurred densities add up. Therefore a line is not drawn towards its neighbours, as it would
 * be towards the centroid of the material around it. Each round is one Gauss-Newton step of
 *     sum over voxels of w (V - M)^2 + sum over lines of stiffness |p_{i-1} - 2 p_i + p_{i+1}|^2
 * for all vertices, one for b, low, high and all radii together, and one for each radius. The weight w (Geman and
 * McClure 1985) ignores fibers that no line represents. The stiffness is the variance of the residuals over the
 * variance of the fibers' curvature, so noisy scans give smoother fibers.
 *
 * In the last fit, where the curvature is measured, second differences of neighbouring vertices are correlated
 * (axis_solve.h), as bends of fibers are: if its curvature could change at every voxel, a fiber would take noise for
 * bends.
 *
 * The errors of the axes follow from the same sum (axis_error.h). Where sections are measured, their noise is taken
 * from the gradients of radii, whose scatter contains the correlation of the noise and whatever the model leaves out.
 * Without, the noise of voxels counts as independent, so that the errors are lower limits. */
#ifndef SELVEDGE_GEOMETRY_AXIS_FIT_H
#define SELVEDGE_GEOMETRY_AXIS_FIT_H

#include "base/thread_pool.h"
#include "geometry/fibers/axes/model/axis_profile.h"
#include "geometry/fibers/polyline.h"
#include "geometry/volume/volume.h"

/* Moves `lines`, which have about one vertex per voxel (polylines_resample), and refines their radii; lines of unknown
 * radius start at half of diameter_voxel. *profile is the start, and is refined. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status polylines_fit(struct polyline_set *lines, const struct volume *v, double diameter_voxel, int n_round,
                     struct axis_profile *profile, struct thread_pool *pool, const struct progress *progress,
                     struct error *err);

/* Places vertices one voxel apart along each line and keeps the ends. `out` is initialised and empty.
 * STATUS_NO_MEMORY. */
status polylines_resample(const struct polyline_set *lines, struct polyline_set *out, struct error *err);

#endif
