/* What a helper of the root does with orders of geometry/ranks: it keeps its slab of a volume, and the lines of a round
 * of the fit, and works on them. */
#ifndef SELVEDGE_GEOMETRY_SLAB_HELPER_H
#define SELVEDGE_GEOMETRY_SLAB_HELPER_H

#include "geometry/volume/volume_slabs.h"

struct axis_round;

/* All zero: the helper has nothing. */
struct slab_helper {
    struct volume_slabs slabs; /* as the root has dealt the volume out */
    struct volume volume;      /* the rows `rows` of it; without voxels: there is none */
    struct slab_rows rows;
    size_t n_slice;           /* slices that have come */
    struct axis_round *round; /* of the fit; NULL: there is none */
    struct error lacks;       /* why an order could not be taken: the next one with tasks is refused with it */
};

static inline bool slab_helper_takes(uint32_t kind) { return kind >= RANK_ORDER_SLAB && kind <= RANK_ORDER_BRICKS; }
/* Follows an order of geometry/ranks. The error of one without tasks is returned for the next one that has some.
 * STATUS_FORMAT for an order that is wrong, STATUS_NO_MEMORY, STATUS_IO, STATUS_CANCELLED. */
status slab_helper_follow(struct slab_helper *h, struct rank_team *team, const struct rank_order *order,
                          struct thread_pool *pool, struct error *err);
void slab_helper_release(struct slab_helper *h);

#endif
