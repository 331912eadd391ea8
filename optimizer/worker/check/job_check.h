/* Checks a job before it is submitted: its document and every input file, all faults at once. Nothing is computed that
 * takes longer than reading the files. */
#ifndef SELVEDGE_OPTIMIZER_JOB_CHECK_H
#define SELVEDGE_OPTIMIZER_JOB_CHECK_H

#include "base/status.h"

#include <jansson.h>
#include <stdbool.h>

/* Reads the document at `path`, whose files lie in `folder`. *report: {"faults": [{"code", "field", "detail"}],
 * "warnings": [{"field", "detail"}], "n_file": files that were opened}, owned by the caller. A job with faults would be
 * refused or fail. STATUS_IO, STATUS_NOT_FOUND of the document alone; STATUS_NO_MEMORY. */
status job_check(const char *path, const char *folder, json_t **report, struct error *err);

#endif
