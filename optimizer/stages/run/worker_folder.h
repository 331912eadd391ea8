/* A worker's hold on its job folder: the lock, the attempt that may write, paths. Layout: job_folder.h. */
#ifndef SELVEDGE_OPTIMIZER_WORKER_FOLDER_H
#define SELVEDGE_OPTIMIZER_WORKER_FOLDER_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { WORKER_PATH_BYTES = 4096 };
/* In JOB/work: the fingerprint of the inputs of the last run. */
#define WORKER_FILE_FINGERPRINT "inputs.fingerprint"

struct worker_folder {
    char path[2048];
    int lock_fd;
    long long attempt; /* 0 when run by hand */
    char token[256];   /* "" when run by hand */
};

/* Takes the lock, reads the attempt, and makes work/ and results/. STATUS_NOT_FOUND: there is no such folder;
 * STATUS_STALE: another worker holds it. */
status worker_folder_open(struct worker_folder *f, const char *path, struct error *err);
void worker_folder_close(struct worker_folder *f);
/* Claims the attempt for one start of a worker: makes the file claim-<token>, which only one start can make. An engine
 * gives the name of the start (option --start), such as "slurm-123.0": its number and how often it was started. The
 * claim is needed because an engine may start one submission twice with the same token, on two nodes, where the lock
 * may not reach from one to the other. STATUS_STALE: another start has the attempt. Does nothing in a folder made by
 * hand. */
status worker_folder_claim(const struct worker_folder *f, const char *start, struct error *err);
/* STATUS_STALE when attempt.json names another attempt by now. To be called before every durable write. */
status worker_folder_check(const struct worker_folder *f, struct error *err);
/* Writes "JOB/a/b" to path; b may be NULL. */
void worker_folder_path(const struct worker_folder *f, const char *a, const char *b, char path[WORKER_PATH_BYTES]);
/* worker_folder_check, then durable_replace. */
status worker_folder_replace(const struct worker_folder *f, const char *path, const void *data, size_t n_bytes,
                             struct error *err);

/* Removes the temporary files in work/ and results/ that a worker left that was killed while it wrote. To be called
 * before anything is written; one that cannot be removed does no harm. */
void worker_folder_sweep(const struct worker_folder *f);

/* Checksum of the two things that a checkpoint depends on besides the input files: the text of the job document, and
 * this build of the program. */
uint64_t document_fingerprint(const char *document, size_t n_bytes);

/* Compares the fingerprint of the inputs with the fingerprint of the previous run. If they differ (a document or a file
 * was edited by hand), or there is none, it removes everything that was computed before: work/, results/, series.rec.
 * *changed: there was a fingerprint, and it differs. */
status worker_folder_match_inputs(const struct worker_folder *f, uint64_t fingerprint, bool *changed,
                                  struct error *err);

/* A stage whose outputs are complete has the mark work/<stage>.done. */
bool worker_folder_stage_done(const struct worker_folder *f, const char *stage);
status worker_folder_mark_stage(const struct worker_folder *f, const char *stage, struct error *err);
/* Removes the mark of a stage that is to run again. It is no error if there is none. */
status worker_folder_unmark_stage(const struct worker_folder *f, const char *stage, struct error *err);

#endif
