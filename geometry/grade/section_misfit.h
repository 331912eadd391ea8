/* Whether the sections of traced lines are those that single fibers have, or hold several fibers. */
#ifndef SELVEDGE_GEOMETRY_SECTION_MISFIT_H
#define SELVEDGE_GEOMETRY_SECTION_MISFIT_H

#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

/* How much densities vary around the axes, just within the surface of the fibers: their RMS deviation from a mean and a
 * first harmonic (an axis beside its place) over the RMS density on the axis, in windows of two diameters. Noise does
 * not count, because deviations of every second section are multiplied with deviations of the sections between. Flat
 * fibers are looked at along the ellipses of their sections. Near 0 for single fibers; a yarn that is traced as one
 * fiber has more than SECTION_MOST_MISFIT.
 * v: densities in [0, 1] in cubic voxels. misfit: NaN without fibers. The result does not depend on the number of
 * threads. STATUS_NO_MEMORY. */
status section_misfit_measure(const struct volume *v, const struct fiber_set *f, struct thread_pool *pool,
                              double *misfit, struct error *err);

#define SECTION_MOST_MISFIT 0.1

#endif
