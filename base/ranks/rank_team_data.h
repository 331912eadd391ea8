/* The members of struct rank_team and its messages. Only the files of this folder include this header. */
#ifndef SELVEDGE_BASE_RANK_TEAM_DATA_H
#define SELVEDGE_BASE_RANK_TEAM_DATA_H

#include "base/ranks/rank_link.h"
#include "base/ranks/rank_traffic.h"
#include "base/status.h"

#include <stdatomic.h>
#include <stdbool.h>

enum rank_message {
    RANK_ORDER = 1, /* struct order_head; its bytes follow in messages RANK_PIECE */
    RANK_PIECE,
    RANK_RESULT,  /* results of tasks (rank_share.c) */
    RANK_REQUEST, /* results; asks for more tasks */
    RANK_ASSIGN,  /* two uint64_t: first task and number of tasks; 0: there are no more */
    RANK_CANCEL,  /* the root wants no more results */
    RANK_DONE,    /* the last results of a helper */
    RANK_REFUSE   /* a status and a text: the helper cannot follow */
};

struct rank_refusal {
    int32_t code;
    char text[640];
};

struct rank_team {
    int fd;
    size_t rank, n_rank;
    uint32_t serial;    /* of the present order */
    uint32_t cancelled; /* serial of the last order that was cancelled */
    atomic_bool cancel;
    uint32_t answered;  /* helper: serial of the last order whose end it has reported to the root */
    atomic_bool broken; /* the link has failed */
    bool ended;         /* helper: the root's order to end came while tasks were shared */
    char *buffer;       /* the last message received; RANK_MESSAGE_MOST bytes */
    void *companion;
    struct rank_traffic traffic;
};

/* Sends a message of the present order. */
status rank_team_send(struct rank_team *t, size_t peer, enum rank_message kind, const void *data, size_t n_bytes,
                      struct error *err);
/* Reads the next message into t->buffer. *got is false if there is nothing for the caller: no message within wait_ms, a
 * cancellation (which sets t->cancel), or a message of an earlier order (which is dropped). */
status rank_team_receive(struct rank_team *t, int wait_ms, bool *got, struct rank_frame *frame, struct error *err);
/* Helper: an order that arrives while tasks are shared is the order to end. Passes it on and sets t->ended. */
void rank_team_end_early(struct rank_team *t);
/* Turns a message RANK_REFUSE into an error that names the rank. */
status rank_team_refusal(const struct rank_team *t, const struct rank_frame *frame, struct error *err);

#endif
