/* The processes that run WeasyPrint (report_pdf.h) and Blender (blend_file.h) for a worker, each in a sandbox of its
 * own. */
#ifndef SELVEDGE_OPTIMIZER_PROGRAM_PROCESS_H
#define SELVEDGE_OPTIMIZER_PROGRAM_PROCESS_H

#include "optimizer/report/findings/program_helper.h"

struct job_outline;
struct worker_folder;

/* Starts the helpers that the job needs; none (pid 0) where the program is not installed or no process can be started.
 * They end with the worker. Each order_fd stays open when the worker executes itself. */
void program_processes_start(const struct worker_folder *folder, const struct job_outline *outline,
                             struct program_helpers *helper);

#endif
