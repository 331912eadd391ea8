/* The lock that is held from reading a row of a job to writing it back: a mutex among the threads of this daemon and,
 * where several daemons share the database, locks of the server among the daemons. */
#ifndef SELVEDGE_SERVER_JOB_CHANGE_H
#define SELVEDGE_SERVER_JOB_CHANGE_H

#include "server/jobs/job_service.h"

/* For changes of a job, of the data of an owner, or of both; NULL and NULL: of all jobs. Where the locks of the server
 * cannot be had, changes that this thread tries are refused with the reason until job_change_end. */
void job_change_begin(struct job_service *v, const char *job_id, const char *owner);
void job_change_end(struct job_service *v);

#endif
