/* The process that makes report.pdf of report.html (report_pdf.h), in a sandbox of its own. */
#ifndef SELVEDGE_OPTIMIZER_PDF_PROCESS_H
#define SELVEDGE_OPTIMIZER_PDF_PROCESS_H

#include "optimizer/report/findings/pdf_helper.h"

struct worker_folder;

/* Starts the helper; none (pid 0) where WeasyPrint is not installed or no process can be started. It ends with the
 * worker. order_fd stays open when the worker executes itself. */
void pdf_process_start(const struct worker_folder *folder, struct pdf_helper *helper);

#endif
