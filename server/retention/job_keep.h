/* Jobs that are kept whatever the limits of retention say. The mark is a file in the job's folder, so it goes with the
 * folder: through backups, and into a database that is rebuilt from folders. */
#ifndef SELVEDGE_SERVER_JOB_KEEP_H
#define SELVEDGE_SERVER_JOB_KEEP_H

#include "server/jobs/job_service.h"

/* Marks a job, or takes the mark away; the same twice changes nothing. Durable when it returns. STATUS_NOT_FOUND,
 * STATUS_IO, STATUS_DISK_FULL. */
status job_keep(struct job_service *service, const char *id, bool keep, struct error *err);
bool job_is_kept(const struct job_service *service, const char *id);

#endif
