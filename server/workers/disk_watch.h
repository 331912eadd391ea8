/* Free space on the disk of the data folder, on which it depends whether jobs run. */
#ifndef SELVEDGE_SERVER_DISK_WATCH_H
#define SELVEDGE_SERVER_DISK_WATCH_H

#include "server/jobs/job_service.h"

/* Returns whether so little is free that jobs must pause; was_below: the return value of the call before. While there
 * is enough, paused jobs are queued and the reserve file is kept. */
bool disk_watch(struct job_service *v, bool was_below);

#endif
