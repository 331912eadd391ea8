/* Opens and closes the service of jobs. */
#ifndef SELVEDGE_SERVER_SERVICE_OPEN_H
#define SELVEDGE_SERVER_SERVICE_OPEN_H

#include "server/jobs/job_service.h"

/* Opens the database in the data folder, begins this daemon's lease where the database is shared, and recovers from an
 * earlier stop or kill (job_recovery.h). Fails as store_open does. */
status service_open(const struct settings *settings, struct log *log, struct job_service **service, struct error *err);
/* NULL is accepted. */
void service_close(struct job_service *service);

#endif
