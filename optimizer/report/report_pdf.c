#include "optimizer/report/report_pdf.h"

#include "base/files/durable.h"
#include "base/process.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/job_folder.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool report_pdf_installed(char prefix[WORKER_PATH_BYTES])
{
    char folder[WORKER_PATH_BYTES - 8], up[WORKER_PATH_BYTES], whole[PATH_MAX];
    if (!program_find(JOB_PDF_PROGRAM, folder, sizeof folder)) return false;
    snprintf(up, sizeof up, "%s/..", folder);
    /* from a /bin of its own it needs only the folders that every program needs */
    const bool all = realpath(up, whole) == NULL || strcmp(whole, "/") == 0;
    snprintf(prefix, WORKER_PATH_BYTES, "%s", all ? "/usr" : up);
    return true;
}

void report_pdf_warn(const struct report *report)
{
    char prefix[WORKER_PATH_BYTES];
    if (!report->in.results->export_pdf || report_pdf_installed(prefix)) return;
    worker_status_warn(report->in.job->tools->status,
                       "report.pdf was not made: this machine has no program '%s' (Debian package %s)", JOB_PDF_PROGRAM,
                       JOB_PDF_PROGRAM);
}

void report_pdf_paths(const struct worker_folder *folder, struct pdf_paths *p)
{
    worker_folder_path(folder, JOB_FOLDER_RESULTS, "report.html", p->from);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, ".part-report.pdf", p->part);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, "report.pdf", p->to);
}

status report_pdf_write(struct report *report, struct error *err)
{
    char prefix[WORKER_PATH_BYTES];
    struct pdf_paths path;
    if (!report->in.results->export_pdf || !report_pdf_installed(prefix)) return STATUS_OK;
    report_pdf_paths(report->in.job->tools->folder, &path);
    if (program_helper_run(&report->in.helper.pdf, &report->in.job->tools->progress) && access(path.part, F_OK) == 0) {
        status s = worker_folder_check(report->in.job->tools->folder, err);
        return s == STATUS_OK ? durable_rename(path.part, path.to, err) : s;
    }
    unlink(path.part);
    if (progress_cancelled(&report->in.job->tools->progress))
        return error_set(err, STATUS_CANCELLED, "cancelled while making report.pdf");
    worker_status_warn(report->in.job->tools->status, "report.pdf was not made: the program '%s' failed",
                       JOB_PDF_PROGRAM);
    return STATUS_OK;
}
