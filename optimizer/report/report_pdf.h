/* results/report.pdf: report.html as PDF, for jobs that ask for it. The program WeasyPrint makes it, which
 * Selvedge does not need otherwise (Debian package weasyprint). A worker in its sandbox starts no programs, so a helper
 * process with a sandbox of its own is started before, and waits until the page is written. */
#ifndef SELVEDGE_OPTIMIZER_REPORT_PDF_H
#define SELVEDGE_OPTIMIZER_REPORT_PDF_H

#include "optimizer/report/findings/report.h"

/* Starts the helper; none (pid 0) where WeasyPrint is not installed or no process can be started. It ends with the
 * worker. order_fd stays open when the worker executes itself. */
void report_pdf_start_helper(const struct worker_folder *folder, struct pdf_helper *helper);
/* Warns when the job asks for a PDF that this machine cannot make: before results are written, which list warnings. */
void report_pdf_warn(const struct report *report);
/* Makes the PDF of the written page. One that cannot be made is a warning. STATUS_CANCELLED. */
status report_pdf_write(struct report *report, struct error *err);

#endif
