/* Files that a worker or the check of a job writes into the job's folder. data: the data folder. */
#ifndef SELVEDGE_SERVER_WORKER_FILES_H
#define SELVEDGE_SERVER_WORKER_FILES_H

#include <jansson.h>

/* Returns JOB/status.json, the progress and the end of a job as its worker reports them (docs/api.md), owned by the
 * caller, or NULL if there is none or it is damaged. */
json_t *worker_status_read(const char *data, const char *job_id);
/* Returns JOB/plan.json, the resources that a job was expected to need before it ran (input_plan of
 * server/workers/input_judge.h), owned by the caller, or NULL. */
json_t *worker_plan_read(const char *data, const char *job_id);

#endif
