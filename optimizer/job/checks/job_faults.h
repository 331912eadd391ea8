/* All faults of a job document at once: the reader of options goes on after a value that is not allowed. */
#ifndef SELVEDGE_OPTIMIZER_JOB_FAULTS_H
#define SELVEDGE_OPTIMIZER_JOB_FAULTS_H

#include "base/status.h"

#include <jansson.h>

enum { JOB_MAX_FAULT = 100 };

struct job_fault_list {
    size_t n, n_more; /* n_more: faults beyond JOB_MAX_FAULT, which are not kept */
    struct error fault[JOB_MAX_FAULT];
};

/* Adds a fault; one with the same field and text is not added again. */
void job_faults_add(struct job_fault_list *list, const struct error *fault);
/* [{"code", "field", "detail"}], and a last entry that counts those that were not kept. The caller owns it. */
json_t *job_faults_json(const struct job_fault_list *list);

#endif
