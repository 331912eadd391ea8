/* results/report.json: everything that a report on the job says, in one file that explains itself. */
#ifndef SELVEDGE_OPTIMIZER_REPORT_DATA_H
#define SELVEDGE_OPTIMIZER_REPORT_DATA_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>

/* {"format", "program", "started_unix_s", "written_unix_s", "document": the job document as given,
 *  "inputs": [{"name", "role", "size", "sha256"}], "curve": [{"model", "step", "objective", "objective_se",
 *  "n_path_total"}], "result": result.json}. The caller owns it. STATUS_NO_MEMORY; STATUS_IO. */
status report_data(struct report *report, json_t **data, struct error *err);

#endif
