/* Brings the state that a stopped or killed daemon left behind into a consistent one. */
#ifndef SELVEDGE_SERVER_JOB_RECOVERY_H
#define SELVEDGE_SERVER_JOB_RECOVERY_H

#include "server/jobs/job_service.h"

/* Removes deleted jobs, moves unknown job folders to the quarantine, makes missing folders and journals, queues jobs
 * that were running, and recovers uploads. An entry that cannot be processed is logged and skipped, because one bad
 * folder must not make all other jobs unavailable. With a shared database the daemon that began before all others
 * calls this; other daemons wait with their changes meanwhile. */
status job_recover(struct job_service *v, struct error *err);

#endif
