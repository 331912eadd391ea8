/* Which finished jobs go because they are old or because all jobs together take too much disk, and their removal.
 * Drafts and jobs that are queued, paused or running never go, nor do jobs that are kept (job_keep.h) or whose geometry
 * such a job asks for. Each removal is logged and recorded in removed.rec of the data folder. */
#ifndef SELVEDGE_SERVER_RETENTION_H
#define SELVEDGE_SERVER_RETENTION_H

#include "server/jobs/job_service.h"

/* 0: no limit */
struct retention_limits {
    int64_t max_age_days; /* since a job's end */
    int64_t max_bytes;    /* of the folders of all jobs; while they hold more, those that ended first go */
};

enum retention_reason { RETENTION_AGE, RETENTION_SIZE, RETENTION_REQUEST };
const char *retention_reason_name(enum retention_reason reason);

struct retention_job {
    char id[STORE_ID_BYTES], sample[256];
    enum job_state state;
    double finished_unix_s;
    int64_t bytes; /* on disk; of a file that n jobs share, one n-th */
    enum retention_reason reason;
};

struct retention_plan {
    struct retention_job *job; /* the jobs that would be removed, the one that ended first in front */
    size_t n;
    int64_t removed_bytes, total_bytes; /* of them, and of all jobs */
    int64_t n_kept;                     /* jobs that are kept */
};

/* Walks the folders of all jobs, so it takes a while with many: some 4 us of processor time per file in a warm cache.
 * The caller releases the plan. STATUS_IO, STATUS_NO_MEMORY. */
status retention_plan_make(struct job_service *service, const struct retention_limits *limits,
                           struct retention_plan *plan, struct error *err);
void retention_plan_release(struct retention_plan *plan);

/* Removes a job, if retention may remove it, and describes it in *removed. STATUS_CONFLICT, with the reason, if it may
 * not; STATUS_NOT_FOUND. */
status retention_remove(struct job_service *service, const char *id, enum retention_reason reason,
                        struct retention_job *removed, struct error *err);

/* {"id","sample","state","finished_unix_s","bytes","reason"} of a job. */
json_t *retention_job_view(const struct retention_job *job);
/* The last `most` removals as a list, the newest first, with "removed_unix_s" besides. */
status retention_removals(const struct job_service *service, size_t most, json_t **list, struct error *err);

#endif
