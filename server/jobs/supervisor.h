/* The thread that starts workers, watches them and decides what their end means. It also empties tombstoned jobs' folders and
 * pauses work while the disk is under its floor. */
#ifndef SELVEDGE_SERVER_SUPERVISOR_H
#define SELVEDGE_SERVER_SUPERVISOR_H

#include "server/jobs/job_service.h"

/* Sets service->supervisor. worker_program must be executable (checked here: STATUS_NOT_FOUND). */
status supervisor_start(struct job_service *service, const char *worker_program, struct supervisor **supervisor,
                        struct error *err);
/* Look now instead of at the next tick. */
void supervisor_wake(struct supervisor *supervisor);
/* Workers get SIGTERM, the grace time, SIGKILL; their jobs go back to the queue. Joins the thread. */
void supervisor_stop(struct supervisor *supervisor);

#endif
