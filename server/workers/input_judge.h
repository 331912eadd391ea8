/* Reports of a worker about a job before it is started: all faults and warnings of its input files at once, and the
 * resources that it will need. The worker opens the files in its sandbox, because the daemon opens none of a user's. */
#ifndef SELVEDGE_SERVER_INPUT_JUDGE_H
#define SELVEDGE_SERVER_INPUT_JUDGE_H

#include "server/jobs/job_service.h"

/* Waits until the worker has ended. *report, owned by the caller: {"valid", "errors": [{"code", "field", "detail"}],
 * "warnings": [{"field", "detail"}], "n_file"}. Files that are not complete are errors, and so is an end of the worker
 * that its input has caused. STATUS_NOT_FOUND without such a job; refusal->code is "not_ready" when too many checks
 * run already or this one takes too long, and "stopping" when the daemon stops. */
status input_judge(struct job_service *v, const char *job_id, json_t **report, struct job_refusal *refusal,
                   struct error *err);

/* Plans a job before it runs: *plan, owned by the caller, is the output of `selvedge-worker --plan` (job_need.h), with
 * "planned_unix_s" and "attempt", the number of the job's attempts so far; it stays in the job's folder until its
 * document is replaced. Besides the refusals of input_judge STATUS_CONFLICT when the job runs or has succeeded, and
 * STATUS_INVALID, with a field, when its inputs cannot be read. */
status input_plan(struct job_service *v, const char *job_id, json_t **plan, struct job_refusal *refusal,
                  struct error *err);

#endif
