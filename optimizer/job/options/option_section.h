/* Keys that stand in the wrong section of a job document. */
#ifndef SELVEDGE_OPTIMIZER_OPTION_SECTION_H
#define SELVEDGE_OPTIMIZER_OPTION_SECTION_H

#include "optimizer/job/checks/job_faults.h"
#include "optimizer/job/document/json_field.h"

/* As json_field_check_keys; the error tells the section of a key that only another section has. faults: NULL, or a list
 * that every fault is added to; then it returns STATUS_OK. */
status job_option_check_keys(const struct json_field *f, const char *const *allowed, struct job_fault_list *faults,
                             struct error *err);

#endif
