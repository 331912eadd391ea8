/* Whether the sections of traced lines are those that single fibers have, or hold several fibers. */
#ifndef SELVEDGE_GEOMETRY_SECTION_MISFIT_H
#define SELVEDGE_GEOMETRY_SECTION_MISFIT_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

struct section_misfit {
    /* RMS deviation of the densities around the axes, just within the surface of the fibers, from a mean and a first
     * harmonic (an axis beside its place), over the RMS density on the axis, in windows of two diameters. Near 0 for
     * single fibers; above SECTION_MOST_MISFIT where most lines are yarns. */
    double surface;
    /* Share of the length in lines that hold several fibers: densities vary around the axis also so deep below the
     * surface that neighbours have no part in it. */
    double several_share;
};

/* Noise does not count, because deviations of every second section are multiplied with deviations of the sections
 * between. Flat fibers are looked at along the ellipses of their sections. Both are NaN without fibers.
 * v: densities in [0, 1] in cubic voxels. blur_voxel: standard deviation of the blur of surfaces. The result does not
 * depend on the number of threads. STATUS_NO_MEMORY. */
status section_misfit_measure(const struct volume *v, const struct fiber_set *f, double blur_voxel,
                              struct thread_pool *pool, struct section_misfit *misfit, struct error *err);

#define SECTION_MOST_MISFIT 0.1

#endif
