/* The order of the files of a job's scan. */
#ifndef SELVEDGE_OPTIMIZER_SCAN_ORDER_H
#define SELVEDGE_OPTIMIZER_SCAN_ORDER_H

#include "base/status.h"
#include "base/warning.h"
#include "optimizer/job/document/job_scan.h"

#include <jansson.h>

/* Judges the numbers in the names of a scan that has a file for each slice (slice_order_check), unless the job says
 * that they mean nothing, and adds the order to the ledgers `files` (base/files/file_ledger_json.h). Warns of slices
 * that are numbered by a larger step than 1. STATUS_INVALID, field OPTION_SCAN_FILES; STATUS_NO_MEMORY. */
status scan_order_check(const struct job_scan *scan, json_t *files, const struct warning_sink *warn, struct error *err);

#endif
