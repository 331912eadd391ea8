/* status.json, and the thread that rewrites it several times a second. The same thread waits for SIGTERM and SIGINT
 * and sets the cancel flag, also when the attempt has become stale. All functions may be called from any thread. */
#ifndef SELVEDGE_OPTIMIZER_WORKER_STATUS_H
#define SELVEDGE_OPTIMIZER_WORKER_STATUS_H

#include "base/log.h"
#include "optimizer/stages/run/job_clock.h"
#include "optimizer/stages/run/worker_folder.h"

#include <jansson.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

struct worker_status;

/* A status without the thread, which is written nowhere: for planning. STATUS_NO_MEMORY. */
status worker_status_new(const struct worker_folder *folder, struct log *log, struct worker_status **st,
                         struct error *err);
/* The same with the thread, written to `file` of the job's folder: JOB_FILE_STATUS, or JOB_FILE_PICTURES. SIGTERM and
 * SIGINT must be blocked in the caller (and so in all threads made later). */
status worker_status_start(const struct worker_folder *folder, struct log *log, const char *file,
                           struct worker_status **st, struct error *err);
/* Writes the final state ("succeeded", "failed", "cancelled") durably and ends the thread; error only for "failed". A
 * stale worker writes nothing. */
status worker_status_finish(struct worker_status *st, const char *state, const struct error *error, struct error *err);
void worker_status_free(struct worker_status *st);

/* Time at which the worker began. */
double worker_status_started_unix_s(const struct worker_status *st);
const atomic_bool *worker_status_cancel(const struct worker_status *st);
bool worker_status_stale(const struct worker_status *st);

/* Progress and remaining time (job_clock.h). Speeds of earlier jobs are given before the first stage begins, the work
 * of a stage before that stage. */
void worker_status_speeds(struct worker_status *st, const struct speed_book *book);
void worker_status_plan(struct worker_status *st, size_t i_stage, const struct job_clock_work *work);
void worker_status_plan_own(struct worker_status *st, size_t i_stage, const char *key, double seconds);
void worker_status_plan_share(struct worker_status *st, size_t i_stage, const char *key, double share, size_t i_of);
/* Remaining time as it is told to readers. */
struct job_clock_look worker_status_look(struct worker_status *st);
double worker_status_expected_s(struct worker_status *st, size_t i_stage);
/* Begins stage i_stage of n_stage, and ends it; loaded: an earlier attempt has done it. */
void worker_status_stage(struct worker_status *st, const char *name, const char *title, size_t i_stage, size_t n_stage);
void worker_status_stage_end(struct worker_status *st, bool loaded);
void worker_status_fraction(struct worker_status *st, double stage_fraction);
/* Measures the running stage from here on, because an earlier attempt did the part before. */
void worker_status_restart_eta(struct worker_status *st);
/* Adds the speeds of this attempt's stages to the book. */
void worker_status_remember(struct worker_status *st, struct speed_book *book);
void worker_status_message(struct worker_status *st, const char *text);
/* Takes over the verdict on the result (verdict_json); null until it is reached. */
void worker_status_verdict(struct worker_status *st, json_t *verdict);
void worker_status_objective(struct worker_status *st, size_t step, double objective, double se);
/* Formats a warning as printf does, keeps it in the list and writes it to the log; a warning that the list has
 * already is not added again. From the 50th on they are in the log only, and the list's last entry counts them. */
void worker_status_warn(struct worker_status *st, const char *format, ...) __attribute__((format(printf, 2, 3)));
size_t worker_status_n_warning(struct worker_status *st);
/* Copies warning i to text. Returns false when there is none. */
bool worker_status_warning(struct worker_status *st, size_t i, char *text, size_t n_bytes);

#endif
