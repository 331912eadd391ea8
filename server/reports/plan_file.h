/* JOB/plan.json: what a job was expected to take before it ran (input_plan of server/workers/input_judge.h). */
#ifndef SELVEDGE_SERVER_KEPT_PLAN_H
#define SELVEDGE_SERVER_KEPT_PLAN_H

#include <jansson.h>

/* The plan that is kept, owned by the caller; NULL when there is none. */
json_t *kept_plan_read(const char *data, const char *job_id);

#endif
