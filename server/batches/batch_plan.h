/* What the samples of a batch are expected to take together, and how far off that was. */
#ifndef SELVEDGE_SERVER_BATCH_PLAN_H
#define SELVEDGE_SERVER_BATCH_PLAN_H

#include "server/jobs/job_service.h"
#include "server/store/store_batch.h"

/* The JSON of a plan as docs/api.md describes it: sums over the samples that input_plan has planned, the time on n_core
 * cores, and the same sums of those that have succeeded since in one attempt, beside what these have taken. n_core: 0
 * for as many as the workers of this service have. */
status batch_plan(struct job_service *v, const struct batch_row *batch, size_t n_core, json_t **plan,
                  struct error *err);

#endif
