/* The ranks of one job: rank 0, the root, runs the job; the others, its helpers, wait for orders and share the tasks of
 * some of them. All orders go from rank to rank along a binomial tree, even an order for one helper, so that each rank
 * gets them in the sequence in which the root sent them. It is not determined which rank runs a task, or when its
 * result arrives. Each task therefore writes to its own slot (thread_pool.h), and the root combines the slots in
 * sequence: results do not depend on the number of ranks.
 *
 * Only the thread that runs the job calls these functions; the functions of a struct rank_work are called by any
 * thread. */
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
    RANK_ORDER_ESTIMATE, /* rank_request.h */
    RANK_ORDER_PICTURE,  /* rank_request.h */
    RANK_ORDER_AGREE,    /* a text; a helper refuses the order if its own text differs */
    /* geometry */
    RANK_ORDER_SLAB,       /* volume_slabs.h: which part of a volume a rank has */
    RANK_ORDER_ROWS,       /* volume_slabs.h: densities of the rank's part */
    RANK_ORDER_DIRECTIONS, /* direction_share.h */
    RANK_ORDER_AXES,       /* axis_share.h: the lines of a round of the fit */
    RANK_ORDER_BRICKS      /* axis_share.h */
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
/* Stores a pointer of the caller with the team, for example to the data that the ranks share. Not owned. */
void rank_team_accompany(struct rank_team *team, void *companion);
void *rank_team_companion(const struct rank_team *team);
struct rank_traffic rank_team_traffic(const struct rank_team *team);
/* Set in a helper while the root has cancelled the tasks that are shared. */
const atomic_bool *rank_team_cancel(const struct rank_team *team);

/* Root: sends an order to all helpers. STATUS_IO. */
status rank_team_order(struct rank_team *team, uint32_t kind, const void *data, size_t n_bytes, struct error *err);
/* Root: sends an order without tasks to one helper alone. STATUS_IO. */
status rank_team_order_to(struct rank_team *team, size_t rank, uint32_t kind, const void *data, size_t n_bytes,
                          struct error *err);
/* Helper: waits for the next order, and passes it on. STATUS_IO when the root is gone. */
status rank_team_wait(struct rank_team *team, struct rank_order *order, struct error *err);
void rank_order_release(struct rank_order *order);
/* Helper: reports that it could not follow the order; rank_team_share or rank_team_gather of the root then returns the
 * error. Does nothing if the helper has already reported the end of the order. */
void rank_team_refuse(struct rank_team *team, const struct error *why);
/* rank_team_confirm, helper: reports that an order without tasks is done. rank_team_gather, root: waits for the reports
 * of all helpers. */
void rank_team_confirm(struct rank_team *team);
status rank_team_gather(struct rank_team *team, struct error *err);
/* Helper: reads waiting messages during long work without shared tasks, so that rank_team_cancel is set when the root
 * cancels the order or ends this rank. Called by one thread at a time. */
void rank_team_heed(struct rank_team *team);

/* Tasks that all ranks share. pack writes the result of a task, at most most_bytes, and returns its size. unpack runs
 * in the root: it stores the result in the task's slot, and returns false if the bytes are no valid result. */
struct rank_work {
    size_t n_task, most_bytes;
    /* NULL: any rank can run any task. Otherwise rank r runs the tasks first[r] .. first[r + 1] - 1. */
    const size_t *first;
    task_function run;
    size_t (*pack)(void *context, size_t i_task, void *to);
    bool (*unpack)(void *context, size_t i_task, const void *from, size_t n_bytes);
    void *context;
};

/* Runs all tasks; afterwards all slots of the root are filled. The root calls this after an order, and every helper
 * that follows the order calls it with the same tasks. If work->first is NULL, half of the tasks are assigned
 * beforehand, and the others in ever smaller parts to ranks that ask. STATUS_CANCELLED; in the root also STATUS_IO,
 * STATUS_NO_MEMORY, and the status of a helper's refusal. */
status rank_team_share(struct rank_team *team, const struct rank_work *work, struct thread_pool *pool,
                       const struct progress *progress, struct error *err);

#endif
