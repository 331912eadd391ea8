/* JOB/plan.json: the resources that a job was expected to need before it ran (input_plan of
 * server/workers/input_judge.h). */
#ifndef SELVEDGE_SERVER_PLAN_FILE_H
#define SELVEDGE_SERVER_PLAN_FILE_H

#include <jansson.h>

/* Returns the stored plan, owned by the caller, or NULL when there is none. */
json_t *plan_file_read(const char *data, const char *job_id);

#endif
