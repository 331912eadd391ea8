/* One round of the fit of axes (axis_fit.h) up to the sums of its bricks, which several ranks may share
 * (geometry/fibers/axes/axis_share.h). */
#ifndef SELVEDGE_GEOMETRY_AXIS_ROUND_H
#define SELVEDGE_GEOMETRY_AXIS_ROUND_H

#include "base/thread_pool.h"
#include "geometry/fibers/axes/axis_brick.h"

/* Bricks that are fitted before their sums are added. */
struct axis_batch {
    struct axis_model model;
    size_t first_brick, n_brick;
    struct axis_scratch *scratch; /* one per thread */
    struct axis_brick_sum *sum;   /* one per brick */
    bool *failed;                 /* one per thread */
};

/* Makes the work of the threads. STATUS_NO_MEMORY. */
status axis_batch_init(struct axis_batch *b, size_t n_thread, struct error *err);
void axis_batch_release(struct axis_batch *b, size_t n_thread);
/* Makes empty sums for the bricks. STATUS_NO_MEMORY. */
status axis_batch_start(struct axis_batch *b, struct error *err);
void axis_batch_end(struct axis_batch *b);
/* A task: fits brick first_brick + i_brick. */
void axis_batch_fit(void *batch, size_t i_brick, size_t i_thread);
void axis_brick_sum_release(struct axis_brick_sum *sum);

/* Prepares the model for its profile, and for lines in a volume of n voxels. view, reach: room for one of each segment;
 * view NULL: discs. *bricks, which is initialised here, and both arrays must outlive the model's use. The sections of
 * the profile are turned with the lines. STATUS_NO_MEMORY, STATUS_TOO_LARGE. */
status axis_round_prepare(struct axis_model *m, const struct polyline_set *lines, const size_t n[3],
                          struct section_view *view, float *reach, struct segment_bricks *bricks, struct error *err);

/* Prepares a model of discs for the same lines in a later round. The voxels keep their nearest segments from the last
 * axis_round_prepare: lines at rest have moved by a tenth of a voxel since, which hardly changes the nearest segments.
 * *bricks comes from the same round; *nearest_of becomes their segments, as in segment_bricks_move.
 * STATUS_NO_MEMORY. */
status axis_round_follow(struct axis_model *m, const struct polyline_set *lines, struct segment_bricks *bricks,
                         struct segment **nearest_of, struct error *err);

#endif
