/* One attempt at a job: what is written before its worker starts, and what the worker's end means for the job. */
#ifndef SELVEDGE_SERVER_ATTEMPT_H
#define SELVEDGE_SERVER_ATTEMPT_H

#include "server/jobs/job_service.h"
#include "server/jobs/worker_process.h"

/* Why the daemon asked a worker to stop, strongest first. */
enum attempt_stop { STOP_NONE, STOP_CANCEL, STOP_SHUTDOWN, STOP_PAUSE, STOP_SILENT };

struct attempt_verdict {
    double delay_s; /* before the job may start again */
    bool busy;      /* the folder was locked by another process */
};

struct attempt_wish {
    bool cancel, deleted;
    double heartbeat_unix_s; /* the worker's own clock; 0: no heartbeat of this attempt, or it cannot be read */
};

/* queued -> running: new number and token, job.json, attempt.json, and a clean folder after an edit.
 * STATUS_CONFLICT when the job is not queued any more. */
status attempt_prepare(struct job_service *v, const char *job_id, struct error *err);
/* What the running job's owner wants by now, and whether its worker lives. False when the database cannot be read: then
 * nothing is known, and nothing is wished for. */
bool attempt_look(struct job_service *v, const char *job_id, struct attempt_wish *wish);
/* running -> succeeded, failed, cancelled, paused or queued. */
status attempt_settle(struct job_service *v, const char *job_id, const struct worker_end *end, enum attempt_stop stop,
                      struct attempt_verdict *verdict, struct error *err);
/* queued -> failed */
status attempt_give_up(struct job_service *v, const char *job_id, const char *why, struct error *err);
/* paused -> queued, all of them */
void attempt_resume_paused(struct job_service *v);

/* status.json of a job, or NULL when there is none (or it is damaged). The caller owns the object. */
json_t *attempt_read_status(const struct job_service *v, const char *job_id);

#endif
