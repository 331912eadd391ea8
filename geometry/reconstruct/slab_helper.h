/* Follows the orders for work on a volume, in a helper of the root (base/ranks/rank_team.h): the helper stores its slab
 * of the volume and the lines of the present round of the fit, and works on them. */
#ifndef SELVEDGE_GEOMETRY_SLAB_HELPER_H
#define SELVEDGE_GEOMETRY_SLAB_HELPER_H

#include "geometry/fibers/axes/axis_share.h"

/* All zero: the helper has nothing. */
struct slab_helper {
    struct helper_slab slab;
    struct axis_round *round; /* of the fit; NULL: there is none */
    struct error lacks;       /* why an order could not be taken: the next one with tasks is refused with it */
};

static inline bool slab_helper_takes(uint32_t kind) { return kind >= RANK_ORDER_SLAB && kind <= RANK_ORDER_BRICKS; }
/* Follows an order for work on a volume. The error of an order without tasks is returned for the next one with tasks.
 * STATUS_FORMAT for an order that is wrong, STATUS_NO_MEMORY, STATUS_IO, STATUS_CANCELLED. */
status slab_helper_follow(struct slab_helper *h, struct rank_team *team, const struct rank_order *order,
                          struct thread_pool *pool, struct error *err);
void slab_helper_release(struct slab_helper *h);

#endif
