/* The thread that starts workers, watches them and records their end. It also removes the folders of deleted jobs,
 * and pauses jobs while the free disk space is below the floor. */
#ifndef SELVEDGE_SERVER_SUPERVISOR_H
#define SELVEDGE_SERVER_SUPERVISOR_H

#include "server/jobs/job_service.h"

struct supervisor;

/* Becomes service->runner. STATUS_NOT_FOUND or STATUS_IO if the backend of the settings cannot be used, as when
 * worker_program cannot be executed; STATUS_NO_MEMORY. */
status supervisor_start(struct job_service *service, const char *worker_program, struct supervisor **supervisor,
                        struct error *err);
/* Stops all workers by SIGTERM and, after the grace time, SIGKILL; their jobs are queued. Workers that outlive the
 * daemon (jobs.backend) are left alone. Joins the thread. */
void supervisor_stop(struct supervisor *supervisor);

#endif
