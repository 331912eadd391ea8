/* The state of a job by the files of its worker. */
#ifndef SELVEDGE_SERVER_WORKER_EVIDENCE_H
#define SELVEDGE_SERVER_WORKER_EVIDENCE_H

#include "server/store/store.h"

#include <stdio.h>

/* Corrects state, attempt, times and error of a row by the files in its folder: an attempt that was running may have
 * ended, and a job that has succeeded must have its result. bare: the job is known by its folder only. resume: a job
 * that was running or paused is queued; otherwise it is cancelled, and keeps its checkpoints for a retry. */
void worker_evidence_apply(const char *folder, bool bare, bool resume, struct job_row *row, FILE *notes);

#endif
