/* The thread that removes jobs by the limits of the settings (retention.max_age_days, retention.max_bytes), every
 * retention.check_s seconds. The first look is after that time, too: who mistypes a limit can still stop the daemon. */
#ifndef SELVEDGE_SERVER_RETENTION_WATCH_H
#define SELVEDGE_SERVER_RETENTION_WATCH_H

#include "server/jobs/job_service.h"

struct retention_watch;
/* Without limits *watch is NULL and nothing is removed. STATUS_IO, STATUS_NO_MEMORY. */
status retention_watch_start(struct job_service *service, struct retention_watch **watch, struct error *err);
/* Joins the thread. NULL is accepted. */
void retention_watch_stop(struct retention_watch *watch);

#endif
