/* The kinds of orders that the root of a team sends to its helpers. The header named beside a kind describes the
 * content of the order. */
#ifndef SELVEDGE_BASE_RANK_ORDER_KIND_H
#define SELVEDGE_BASE_RANK_ORDER_KIND_H

enum rank_order_kind {
    RANK_ORDER_END = 0, /* ends the helper */
    /* renderer/transport/ranks */
    RANK_ORDER_CLOTH,    /* shared_cloth.h */
    RANK_ORDER_ESTIMATE, /* rank_request.h, as the next */
    RANK_ORDER_PICTURE,
    RANK_ORDER_AGREE, /* a text; helpers refuse when theirs is another */
    /* geometry/ranks */
    RANK_ORDER_SLAB,       /* volume_slabs.h, as the next: which part of a volume a rank has */
    RANK_ORDER_ROWS,       /* densities of the rank's part */
    RANK_ORDER_DIRECTIONS, /* direction_share.h */
    RANK_ORDER_AXES,       /* axis_share.h, as the next: the lines of a round of the fit */
    RANK_ORDER_BRICKS
};

#endif
