/* results/report.html and results/report.json: the report on a job. The page has everything in itself, runs no script
 * and loads nothing, so it can be sent, printed and kept. */
#ifndef SELVEDGE_OPTIMIZER_REPORT_PAGE_H
#define SELVEDGE_OPTIMIZER_REPORT_PAGE_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdio.h>

/* After result.json and the pictures are written. STATUS_NO_MEMORY, and the errors of worker_folder_replace. */
status report_write(struct report *report, struct error *err);

/* ---- parts ---- */

/* The content of report.json, one file that explains itself:
 * {"format", "program", "started_unix_s", "written_unix_s", "document": the job document as given,
 *  "inputs": [{"name", "role", "size", "sha256"}], "curve": [{"model", "step", "objective", "objective_se",
 *  "n_path_total"}], "result": result.json}. The caller owns it. STATUS_NO_MEMORY; STATUS_IO. */
status report_data(struct report *report, json_t **data, struct error *err);

#endif
