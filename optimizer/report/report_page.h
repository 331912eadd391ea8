/* results/report.html and results/report.json: the report on a job. The page has everything in itself, runs no script
 * and loads nothing, so it can be sent, printed and kept. */
#ifndef SELVEDGE_OPTIMIZER_REPORT_PAGE_H
#define SELVEDGE_OPTIMIZER_REPORT_PAGE_H

#include "optimizer/report/findings/report.h"

/* After result.json and the pictures are written. STATUS_NO_MEMORY, and the errors of worker_folder_replace. */
status report_write(struct report *report, struct error *err);

#endif
