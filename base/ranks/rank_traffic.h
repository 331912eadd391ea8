/* Counts of the messages between the ranks of a job. */
#ifndef SELVEDGE_BASE_RANK_TRAFFIC_H
#define SELVEDGE_BASE_RANK_TRAFFIC_H

#include <stddef.h>
#include <stdint.h>

/* Messages and bytes that the ranks of a job have exchanged, and how the root has spent its time. */
struct rank_traffic {
    size_t n_order, n_share, n_task, n_message; /* messages: those that the root has received */
    uint64_t order_bytes, result_bytes;         /* of orders once, however many ranks get them */
    double share_s, wait_s; /* in rank_team_share, and in it after the root's own last task, waiting for helpers */
    size_t n_own;           /* tasks that the root has run itself */
    double own_cpu_s;       /* processor time of these */
    double share_cpu_s;     /* processor time of the process in rank_team_share */
    double cpu_s;           /* of the process, until now */
};

#endif
