/* Jobs that must not be looked at again before a certain time. The list is of fixed size; when it is full, the job
 * whose time comes first is forgotten. Not thread-safe. */
#ifndef SELVEDGE_SERVER_WAITING_LIST_H
#define SELVEDGE_SERVER_WAITING_LIST_H

#include "server/store/store.h"

enum { WAITING_LIST_MAX = 256 };

/* A queued job that must not start before a certain time, after a lost attempt or while another process has its
 * folder; or a deleted job whose folder could not be removed. */
struct waiting {
    char job_id[STORE_ID_BYTES];
    double until_s; /* by the monotonic clock */
    int n_busy;     /* how often another process had the folder */
};

struct waiting_list {
    struct waiting job[WAITING_LIST_MAX];
};

/* Returns the entry of a job. Without one it is made, or NULL is returned. */
struct waiting *waiting_list_find(struct waiting_list *list, const char *job_id, bool make);
/* Whether the job has to wait longer. */
bool waiting_list_holds(struct waiting_list *list, const char *job_id, double now_s);
/* Number of jobs that have to wait longer. */
size_t waiting_list_count(const struct waiting_list *list, double now_s);

#endif
