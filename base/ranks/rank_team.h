/* The ranks of one job: rank 0, the root, runs the job; the others, its helpers, wait for orders and share the tasks of
 * some of them. Orders go from rank to rank along a binomial tree, those for one helper, too, so that each rank gets
 * its orders in the order in which the root has sent them. Which rank runs which task is not determined, and neither is
 * the order in which results arrive, so a task writes to a slot of its own (thread_pool.h), and the root combines the
 * slots in order: results do not depend on the ranks.
 *
 * All functions but those of one rank_team_share are called by the thread that runs the job.
 */
#ifndef SELVEDGE_BASE_RANK_TEAM_H
#define SELVEDGE_BASE_RANK_TEAM_H

#include "base/progress.h"
#include "base/ranks/rank_traffic.h"
#include "base/thread_pool.h"

#include <stdint.h>

/* The kinds of orders that the root of a team sends to its helpers. The header named beside a kind describes the
 * content of the order. */
enum rank_order_kind {
    RANK_ORDER_END = 0, /* ends the helper */
    /* renderer/estimate */
    RANK_ORDER_CLOTH,    /* shared_cloth.h */
    RANK_ORDER_ESTIMATE, /* rank_request.h, as the next */
    RANK_ORDER_PICTURE,
    RANK_ORDER_AGREE, /* a text; helpers refuse when theirs is another */
    /* geometry */
    RANK_ORDER_SLAB,       /* volume_slabs.h, as the next: which part of a volume a rank has */
    RANK_ORDER_ROWS,       /* densities of the rank's part */
    RANK_ORDER_DIRECTIONS, /* direction_share.h */
    RANK_ORDER_AXES,       /* axis_share.h, as the next: the lines of a round of the fit */
    RANK_ORDER_BRICKS
};

struct rank_team;

enum { RANK_TEAM_MOST = 65536 };

struct rank_order {
    uint32_t kind;
    void *data; /* owned: rank_order_release */
    size_t n_bytes;
};

/* fd: a rank_link, which the team closes. STATUS_NO_MEMORY. */
status rank_team_open(int fd, size_t rank, size_t n_rank, struct rank_team **team, struct error *err);
/* The root sends RANK_ORDER_END. */
void rank_team_close(struct rank_team *team);
size_t rank_team_rank(const struct rank_team *team);
size_t rank_team_n_rank(const struct rank_team *team);
/* Whether the link has failed: a rank is lost, and with it the job's team. */
bool rank_team_broken(const struct rank_team *team);
/* Something of the caller's that goes with the team: what the ranks share. Not owned. */
void rank_team_accompany(struct rank_team *team, void *companion);
void *rank_team_companion(const struct rank_team *team);
struct rank_traffic rank_team_traffic(const struct rank_team *team);
/* Set in a helper while the root has cancelled the tasks that are shared. */
const atomic_bool *rank_team_cancel(const struct rank_team *team);

/* Root: sends an order to all helpers. STATUS_IO. */
status rank_team_order(struct rank_team *team, uint32_t kind, const void *data, size_t n_bytes, struct error *err);
/* Root: sends an order to one helper alone. It has no tasks. STATUS_IO. */
status rank_team_order_to(struct rank_team *team, size_t rank, uint32_t kind, const void *data, size_t n_bytes,
                          struct error *err);
/* Helper: waits for the next order, and passes it on. STATUS_IO when the root is gone. */
status rank_team_wait(struct rank_team *team, struct rank_order *order, struct error *err);
void rank_order_release(struct rank_order *order);
/* Helper: tells the root that it could not follow the order, unless it has told it the end of it already. The root's
 * rank_team_share, or rank_team_gather, returns the error. */
void rank_team_refuse(struct rank_team *team, const struct error *why);
/* Helper: tells the root that an order without tasks is done. Root: waits until all helpers have said so. */
void rank_team_confirm(struct rank_team *team);
status rank_team_gather(struct rank_team *team, struct error *err);
/* Helper, while it works for long on an order without sharing tasks: takes note of what the root has sent, so that
 * rank_team_cancel is set when the root cancels the order or ends this rank. From one thread at a time. */
void rank_team_heed(struct rank_team *team);

/* Tasks that all ranks share. pack writes the result of a task, at most most_bytes, and returns its size; unpack, in
 * the root, puts it into the task's slot and returns false when it cannot be one. */
struct rank_work {
    size_t n_task, most_bytes;
    /* Where every rank can run its own tasks only: rank r runs first[r] .. first[r + 1] - 1. NULL: any rank can run
     * any task. */
    const size_t *first;
    task_function run;
    size_t (*pack)(void *context, size_t i_task, void *to);
    bool (*unpack)(void *context, size_t i_task, const void *from, size_t n_bytes);
    void *context;
};

/* Root, after an order, and every helper that follows it, with the same tasks: runs all tasks. In the root all slots
 * are filled afterwards. Unless every rank has its own, half of the tasks are dealt out beforehand, the others in ever
 * smaller parts to ranks that ask. STATUS_CANCELLED; in the root also what a helper has refused with, STATUS_IO,
 * STATUS_NO_MEMORY. */
status rank_team_share(struct rank_team *team, const struct rank_work *work, struct thread_pool *pool,
                       const struct progress *progress, struct error *err);

#endif
