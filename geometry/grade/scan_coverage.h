/* How much of the material of a scan the traced fibers explain.
 *
 * A voxel is unexplained if it lies at least COVERAGE_APART_VOXEL beyond the surface of every fiber and the densities
 * around it, without those nearer to fibers, exceed the local background. Voxels near the faces of the scan do not
 * count: fibers whose axes lie beyond a face reach half a diameter into the scan. The means are over cubes of an edge
 * of about 0.7 fiber diameters, less the blurred rims of the fibers. Background and noise of these means come from the
 * void of the scan, in blocks of its columns, so that a signal that varies over the scan (cupping, rims of truncated
 * scans) is no material. */
#ifndef SELVEDGE_GEOMETRY_SCAN_COVERAGE_H
#define SELVEDGE_GEOMETRY_SCAN_COVERAGE_H

#include "base/thread_pool.h"
#include "geometry/grade/coverage_input.h"

#include <stdbool.h>

/* Density above the background that counts as material, in parts of the densest; more where the noise is strong. */
#define COVERAGE_LEAST_DENSITY 0.12
/* Border between light and dense material. */
#define COVERAGE_DENSE 0.6

enum { COVERAGE_DENSE_KIND, COVERAGE_LIGHT_KIND, COVERAGE_KINDS };

struct scan_coverage {
    double explained_share; /* voxels in fibers, over these and the unexplained ones; NaN: not measured */
    /* Share of the unexplained voxels of compact sets in all material, and the share that is explained without them:
     * particles are no fibers that were missed. */
    double particle_share, fiber_share;
    /* The same of dense and of light material; NaN where there is none. share: of all material. */
    struct {
        double share, explained_share;
    } kind[COVERAGE_KINDS];
    double unexplained_density; /* mean above the background; NaN without unexplained voxels */
    size_t slice[3];            /* the slices across x, y, z with the most unexplained voxels */
    double least_density;       /* above the background, that was counted as material */
};

/* Returns whether more than half of the unexplained voxels are of compact sets. */
static inline bool scan_coverage_has_particles(const struct scan_coverage *c)
{
    return c->particle_share > 0.5 * (1.0 - c->explained_share);
}
/* unexplained: NULL, or a byte for each voxel, which becomes 1 where it is unexplained and 0 elsewhere. The result does
 * not depend on the number of threads. STATUS_NO_MEMORY, STATUS_DISK_FULL, STATUS_CANCELLED. */
status scan_coverage_measure(const struct coverage_input *in, struct thread_pool *pool, uint8_t *unexplained,
                             struct scan_coverage *c, struct error *err);

#endif
