/* One attempt at a job: writes the files that its worker needs before it starts, and updates the job when the worker
 * has ended. */
#ifndef SELVEDGE_SERVER_ATTEMPT_H
#define SELVEDGE_SERVER_ATTEMPT_H

#include "server/jobs/job_service.h"
#include "server/workers/backends/worker_process.h"

/* Reasons for which the daemon stops a worker. A reason has precedence over those after it. */
enum attempt_stop {
    STOP_NONE,
    STOP_CANCEL,
    STOP_SHUTDOWN,
    STOP_PAUSE,
    STOP_SILENT,
    STOP_MEMORY,
    STOP_THREADS,
    STOP_DEPTH,
    STOP_TIME
};

struct attempt_outcome {
    double delay_s; /* time before the job may start again */
    bool busy;      /* another process has locked the folder */
};

struct attempt_request {
    bool cancel, deleted;
    double heartbeat_unix_s; /* by the clock of the worker; 0: none of this attempt, or it cannot be read */
};

/* Changes a job from queued to running: claims it, sets a new attempt number and token, writes job.json,
 * letterhead.json and attempt.json, and clears the folder after an edit. token: receives the token of the attempt.
 * STATUS_CONFLICT when the job is no longer queued, or another daemon has claimed it. */
status attempt_prepare(struct job_service *v, const char *job_id, char token[STORE_ID_BYTES], struct error *err);
/* Reads the requests of users about a running job and, while its worker computes, its last heartbeat. Returns false,
 * with no request, when the database cannot be read. */
bool attempt_read_request(struct job_service *v, const char *job_id, bool computes, struct attempt_request *request);
/* Changes a job whose worker has ended from running to succeeded, failed, cancelled, paused or queued. Changes nothing
 * when the job has the token of another attempt: another daemon has taken the job over. */
status attempt_finish(struct job_service *v, const char *job_id, const char *token, const struct worker_end *end,
                      enum attempt_stop stop, struct attempt_outcome *outcome, struct error *err);
/* Changes a job from queued to failed. */
status attempt_fail(struct job_service *v, const char *job_id, const char *why, struct error *err);
/* Queues all paused jobs. */
void attempt_resume_paused(struct job_service *v);

#endif
