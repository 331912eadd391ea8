/* The thread that starts workers, watches them and records their end. It also removes the folders of deleted jobs,
 * and pauses jobs while the free disk space is below the floor. */
#ifndef SELVEDGE_SERVER_SUPERVISOR_H
#define SELVEDGE_SERVER_SUPERVISOR_H

#include "server/jobs/job_service.h"

/* Sets service->supervisor. STATUS_NOT_FOUND or STATUS_IO if the backend of the settings cannot be used, as when
 * worker_program cannot be executed; STATUS_NO_MEMORY. */
status supervisor_start(struct job_service *service, const char *worker_program, struct supervisor **supervisor,
                        struct error *err);
/* The program that it starts. */
const char *supervisor_program(const struct supervisor *supervisor);
/* Writes why no job can be started at present, such as a cluster that cannot be reached; "" otherwise. */
void supervisor_trouble(const struct supervisor *supervisor, char *text, size_t n_text);
/* Makes the thread check at once instead of at its next tick. */
void supervisor_wake(struct supervisor *supervisor);
/* Stops all workers by SIGTERM and, after the grace time, SIGKILL; their jobs are queued. Workers that outlive the
 * daemon (jobs.backend) are left alone. Joins the thread. */
void supervisor_stop(struct supervisor *supervisor);

#endif
