/* results/report.pdf: report.html as PDF, for jobs that ask for it. The program WeasyPrint makes it, which Selvedge
 * does not need otherwise (Debian package weasyprint). A worker in its sandbox starts no programs, so a helper process
 * with a sandbox of its own is started before (optimizer/worker/sandbox/program_process.h), and waits until the page is
 * written. */
#ifndef SELVEDGE_OPTIMIZER_REPORT_PDF_H
#define SELVEDGE_OPTIMIZER_REPORT_PDF_H

#include "optimizer/report/findings/report.h"

/* Finds the program in the folders of PATH; writes the folder above that folder, which has the program's files. */
bool report_pdf_installed(char prefix[WORKER_PATH_BYTES]);

/* The files of the page, as the helper and the worker name them. */
struct pdf_paths {
    char from[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES];
};
void report_pdf_paths(const struct worker_folder *folder, struct pdf_paths *p);

/* Warns when the job asks for a PDF that this machine cannot make: before results are written, which list warnings. */
void report_pdf_warn(const struct report *report);
/* Makes the PDF of the written page. One that cannot be made is a warning. STATUS_CANCELLED. */
status report_pdf_write(struct report *report, struct error *err);

#endif
