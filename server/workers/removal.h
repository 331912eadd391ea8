/* Removes the folders and rows of deleted jobs. */
#ifndef SELVEDGE_SERVER_REMOVAL_H
#define SELVEDGE_SERVER_REMOVAL_H

#include "server/jobs/job_service.h"
#include "server/workers/waiting_list.h"

/* Removes some deleted jobs as far as possible. Jobs that `is_free` refuses and jobs that another daemon runs have to
 * wait. A job whose folder could not be removed gets an entry in the list. Where daemons share the database, one of
 * them does this for all. */
void removal_run(struct job_service *v, struct waiting_list *waiting,
                 bool (*is_free)(void *context, const char *job_id), void *context);

#endif
