/* The resources that the samples of a batch are expected to need together, and how they compare with the resources
 * used. */
#ifndef SELVEDGE_SERVER_BATCH_PLAN_H
#define SELVEDGE_SERVER_BATCH_PLAN_H

#include "server/jobs/job_service.h"
#include "server/store/store_batch.h"

/* The JSON of a plan as docs/api.md describes it: sums over the samples that input_plan has planned, the time on n_core
 * cores, and for the samples that have succeeded since in one attempt the same sums beside the resources used. n_core:
 * 0 for the cores of this service's workers. */
status batch_plan(struct job_service *v, const struct batch_row *batch, size_t n_core, json_t **plan,
                  struct error *err);

#endif
