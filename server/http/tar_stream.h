/* A tar archive of a job's results, made while it is sent, in constant memory and without a temporary file. */
#ifndef SELVEDGE_SERVER_TAR_STREAM_H
#define SELVEDGE_SERVER_TAR_STREAM_H

#include "server/jobs/job_service.h"

#include <microhttpd.h>

/* STATUS_NOT_FOUND, STATUS_IO, STATUS_NO_MEMORY, STATUS_INTERNAL. The caller queues and destroys *response. */
status tar_stream_response(struct job_service *service, const char *job_id, struct MHD_Response **response,
                           struct error *err);

#endif
