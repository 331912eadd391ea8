/* Claims of bricks (axis_claim.h) that are kept from one round of a fit to the next. */
#ifndef SELVEDGE_GEOMETRY_CLAIM_STORE_H
#define SELVEDGE_GEOMETRY_CLAIM_STORE_H

#include "geometry/fibers/axes/model/nearest_segment.h"

#include <stdatomic.h>

/* The claims of a brick, as in struct axis_claims. */
struct claim_list {
    const uint16_t *cell;
    const uint32_t *first;
};

/* Claims of the bricks as far as there is room. Bricks may be added at a time, each by one thread. */
struct claim_store {
    size_t n_brick, most_bytes;
    atomic_size_t n_bytes;
    struct stored_claims {
        uint16_t *cell;
        uint32_t *first; /* NULL: the claims of this brick are not kept */
    } * brick;
};

/* Makes an empty store for n_brick bricks, which keeps at most most_bytes. Returns false when memory is out. */
bool claim_store_init(struct claim_store *s, size_t n_brick, size_t most_bytes);
/* Accepts a store that is all zero. */
void claim_store_release(struct claim_store *s);
/* Keeps a copy of the claims of a brick with n_segment segments, if there is room and memory for it. */
void claim_store_add(struct claim_store *s, size_t i_brick, const struct claim_list *claims, size_t n_segment);
/* Finds the claims of a brick. Returns false if they are not kept. */
bool claim_store_find(const struct claim_store *s, size_t i_brick, struct claim_list *claims);

#endif
