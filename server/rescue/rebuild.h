/* Brings back the database, whole or for one job, from a backup and the folders of the jobs. To be called by the
 * process that holds the lock of the data folder. */
#ifndef SELVEDGE_SERVER_REBUILD_H
#define SELVEDGE_SERVER_REBUILD_H

#include "server/settings/settings.h"
#include "server/store/store.h"

#include <stdbool.h>
#include <stdio.h>

/* Checks the database before a start. STATUS_FORMAT, with the remedy: it is damaged, it is missing while there are
 * folders of jobs, or it is behind them (database_age.h). */
status rebuild_is_needed(const struct settings *settings, struct error *err);

/* Writes a new database: the present one if it is sound, else the newest good backup, else an empty one, and over it
 * the evidence in the folder of each job (job_evidence.h). The present files are moved to DATA/replaced, nothing is
 * deleted. Prints the jobs that were restored and those that were not. resume: see job_evidence.h. After an error the
 * present files are unchanged, but for one in the very last steps, after which the call is to be repeated. STATUS_IO,
 * STATUS_DISK_FULL, ... */
status rebuild(const struct settings *settings, bool resume, FILE *report, struct error *err);

/* Adds the job of the folder DATA/jobs/ID, which the database does not know. Errors as job_evidence_read and
 * store_import. */
status rebuild_one(struct store *store, const char *data, const char *id, FILE *report, struct error *err);

#endif
