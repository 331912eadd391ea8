/* Fibers of a lighter material in a scan.
 *
 * A scan of two materials, such as a warp of 1 and a weft of 0.35 of the density, would lose the lighter fibers:
 * density 1 is the denser material, and filters and thresholds lie halfway to void. Here the voxels of light fibers are
 * found and raised to the density of the others, so that all steps see solid fibers. The rims of dense fibers have the
 * same densities as light fibers, but not the same places: light material lies at least 2.5 voxels from all that is
 * denser than halfway between both materials. */
#ifndef SELVEDGE_GEOMETRY_LIGHT_MATERIAL_H
#define SELVEDGE_GEOMETRY_LIGHT_MATERIAL_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

struct light_material {
    double density; /* of the light fibers, over the dense ones' */
    double share;   /* of the material, by volume */
    double high;    /* value of dense fibers, which exceeds the given one where that is the light fibers' */
};

/* Looks for fibers of 0.15 to 0.6 of the density of others in v (values of a scanner, low for void, high for dense
 * fibers). Where there are any, raises their values to the dense fibers', after a blur where noise is strong for them,
 * and enters their voxels, with their rims, in v->light. Otherwise m->density is NaN, and v stays as it is: also where
 * densities vary gradually, and where thin fibers are paler by blur. STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch
 * space also STATUS_DISK_FULL. */
status light_material_raise(struct volume *v, double low, double high, struct thread_pool *pool,
                            struct light_material *m, struct error *err);

#endif
