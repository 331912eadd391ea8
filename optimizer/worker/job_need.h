/* Predicts the needs of a whole job before it runs: time by the speeds by which its progress is predicted
 * (job_clock.h), processor time, memory and disk by measured cost models. Each of the last three is corrected by a mean
 * ratio in the book of speeds: needs of earlier jobs of the same kind over the model's prediction. */
#ifndef SELVEDGE_OPTIMIZER_JOB_NEED_H
#define SELVEDGE_OPTIMIZER_JOB_NEED_H

#include "optimizer/worker/pipeline_plan.h"

/* The needs of one job: processor seconds of all threads, largest resident memory, bytes of its folder (inputs and
 * results) at its end. */
struct job_need {
    double cpu_s, memory_bytes, disk_bytes;
};

/* The machine that the job's worker may use. */
struct job_need_machine {
    size_t n_thread;           /* 0: one a processor */
    size_t memory_limit_bytes; /* of the geometry stages */
    const char *speeds;        /* the book of speeds; NULL: none are remembered */
};

/* {"error", "n_thread", "wall_s", "wall_low_s", "wall_high_s", "cpu_s", "memory_bytes", "disk_bytes", "stages":
 * [{"name", "wall_s"}]} of a job folder, in which nothing is written. The range of wall_s is two standard deviations
 * either way. "error" is null, or {"code", "field", "text"} where the inputs cannot be read; then the rest is missing.
 * The caller releases the report. STATUS_NO_MEMORY. */
status job_need_report(const char *folder, const struct job_need_machine *machine, json_t **report, struct error *err);

/* Before the first stage of a job that runs, and before its clock is given the speeds of earlier jobs: sets
 * usual_wall_s, the time by usual speeds alone, which the load of this machine does not change. */
void job_need_begin(struct job_plan *plan);
/* Adds the needs of a job that has run to the book. Values that are not positive are left out. */
void job_need_remember(const struct job_plan *plan, const struct job_need *took, struct speed_book *book);

#endif
