/* JOB/status.json: the progress and the end of a job as its worker reports them (docs/api.md). */
#ifndef SELVEDGE_SERVER_STATUS_FILE_H
#define SELVEDGE_SERVER_STATUS_FILE_H

#include <jansson.h>

/* Returns status.json of a job, owned by the caller, or NULL if there is none or it is damaged. */
json_t *status_file_read(const char *data, const char *job_id);

#endif
