/* One archive of a job's results, made while it is sent: constant memory, no temporary file. */
#ifndef SELVEDGE_SERVER_TAR_STREAM_H
#define SELVEDGE_SERVER_TAR_STREAM_H

#include "server/jobs/job_service.h"

#include <microhttpd.h>

status tar_stream_response(struct job_service *service, const char *job_id, struct MHD_Response **response,
                           struct error *err);

#endif
