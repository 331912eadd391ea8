/* Limits of a running worker that the daemon itself looks after: memory, threads, and the depth of its folders. */
#ifndef SELVEDGE_SERVER_WORKER_LIMITS_H
#define SELVEDGE_SERVER_WORKER_LIMITS_H

#include "server/workers/attempt.h"
#include "server/workers/backends/job_backend.h"

/* Returns the limit that a running worker exceeds, with a line in the log, or STOP_NONE. Another attempt would exceed
 * it again, so such a worker is killed at once and its job fails. */
enum attempt_stop worker_limit_exceeded(const struct job_service *v, const struct job_backend *backend,
                                        const struct backend_run *run, const char *job_id);
/* The same of the folders below its job's, which takes a walk through them. */
enum attempt_stop worker_depth_exceeded(const struct job_service *v, const char *job_id);

#endif
