/* Judges the input files of a job before it is started: all faults and warnings at once. A worker in its sandbox opens
 * the files, because the daemon opens none of a user's. */
#ifndef SELVEDGE_SERVER_INPUT_JUDGE_H
#define SELVEDGE_SERVER_INPUT_JUDGE_H

#include "server/jobs/job_service.h"

/* Waits until the worker has ended. *report, owned by the caller: {"valid", "errors": [{"code", "field", "detail"}],
 * "warnings": [{"field", "detail"}], "n_file"}. Files that are not complete are errors, and so is an end of the worker
 * that its input has caused. STATUS_NOT_FOUND without such a job; refusal->code is "not_ready" when too many checks
 * run already or this one takes too long, and "stopping" when the daemon stops. */
status input_judge(struct job_service *v, const char *job_id, json_t **report, struct job_refusal *refusal,
                   struct error *err);

#endif
