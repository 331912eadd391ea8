/* The bricks of the fit of axes (axis_fit.h) over the ranks that have slabs of the volume. The root
 * sends the lines at the beginning of a round, and an order for each batch of bricks; every rank fits the bricks of its
 * columns; the root gets the sums of each brick, and adds the sums of all bricks in order, as without other ranks. */
#ifndef SELVEDGE_GEOMETRY_AXIS_SHARE_H
#define SELVEDGE_GEOMETRY_AXIS_SHARE_H

#include "geometry/fibers/axes/axis_round.h"
#include "geometry/volume/volume_slabs.h"

/* First data of an order RANK_ORDER_AXES. Then come the first vertices of all lines and the number of vertices (64
 * bits), the vertices, the radii of the lines, and with has_shape and has_section the shapes and sections of the
 * vertices. */
struct axes_order {
    uint64_t n_line, n_vertex;
    double blur, low, high; /* of the profile */
    uint8_t has_shape, has_section;
    uint8_t follows; /* whether nearest segments come from the last order that does not follow (axis_round_follow) */
};

/* Data of an order RANK_ORDER_BRICKS. */
struct bricks_order {
    uint64_t first_brick, n_brick; /* whole layers of bricks */
};

/* Root: sends the lines of a round, before they are prepared. STATUS_IO, STATUS_NO_MEMORY. */
status axis_share_round(const struct axis_model *m, const struct polyline_set *lines, bool follows, struct error *err);
/* Root: returns whether the other ranks can fit bricks of the batch: solid fibers in a volume whose slabs they have. */
bool axis_share_can(const struct axis_batch *b);
/* Root: fits the bricks of the batch with all ranks. STATUS_CANCELLED, STATUS_IO, STATUS_NO_MEMORY. */
status axis_share_bricks(struct axis_batch *b, struct thread_pool *pool, const struct progress *progress,
                         struct error *err);

struct axis_round; /* the lines of a round, in a helper */

/* Helper: replaces *round, which may be NULL, by the lines of the order. The slab must outlive it. STATUS_FORMAT,
 * STATUS_NO_MEMORY. */
status axis_share_take(const struct helper_slab *slab, struct axis_round **round, const struct rank_order *order,
                       struct thread_pool *pool, struct error *err);
/* Helper: fits its bricks of a batch; round NULL: STATUS_FORMAT. Errors as before, STATUS_CANCELLED, STATUS_IO. */
status axis_share_help(const struct helper_slab *slab, struct axis_round *round, const struct rank_order *order,
                       struct thread_pool *pool, struct error *err);
/* Accepts NULL. */
void axis_round_free(struct axis_round *r);

#endif
