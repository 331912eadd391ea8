/* The last step of the direction filter: each voxel of material takes the direction of its ridge, if J is low enough
 * there. */
#ifndef SELVEDGE_GEOMETRY_RIDGE_ASSIGN_H
#define SELVEDGE_GEOMETRY_RIDGE_ASSIGN_H

#include "base/thread_pool.h"
#include "geometry/filter/line_bound.h"
#include "geometry/filter/ridge_map.h"

/* Which voxels are kept: those of rows begin .. end - 1 with a density of eps_d and more that the bound reaches, and
 * with J of at most eps_j at their ridge. */
struct ridge_assign {
    const struct volume *v;
    const struct line_bound *bound;
    const struct ridge_map *ridges;
    double j_full; /* J in solid material */
    float eps_d, eps_j;
    size_t begin, end;
};

/* Makes d. kept_only: of kept voxels alone (volume.h). STATUS_CANCELLED, STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status ridge_assign_all(const struct ridge_assign *rule, bool kept_only, struct thread_pool *pool,
                        struct direction_volume *d, struct error *err);

#endif
