/* Copies of the database, and whether a database is sound. Nothing here waits for, or holds up, a store that is open:
 * each call has a connection of its own that only reads. */
#ifndef SELVEDGE_SERVER_STORE_BACKUP_H
#define SELVEDGE_SERVER_STORE_BACKUP_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>

struct store_summary {
    int64_t n_job, n_file, n_key; /* jobs without tombstones, files, idempotency keys */
    int64_t n_bytes;              /* of the database file */
};

/* Checks a database: every page (thorough: contents and indexes too), the tables, and that every job has a document
 * and the counts of jobs are right. *summary may be NULL. STATUS_NOT_FOUND: there is no such file, or it
 * is a database without tables, which a new one is. STATUS_FORMAT: it is
 * damaged, or no database of this service. STATUS_IO and others: it could not be found out. */
status store_examine(const char *path, bool thorough, struct store_summary *summary, struct error *err);

/* Calls visit for the row of each job, tombstones too, of a database of any version. STATUS_FORMAT, STATUS_IO. */
status store_read_ages(const char *path, void (*visit)(void *context, const char *id, double updated_unix_s),
                       void *context);

/* Copies the database `path`, with all changes that calls have returned from, to the new file `to`: into a temporary
 * file beside it, which is examined thoroughly, synced and renamed. Nothing is left after an error. STATUS_EXISTS when
 * there is a file `to`, STATUS_NOT_FOUND, STATUS_FORMAT (as store_examine), STATUS_DISK_FULL, STATUS_IO. */
status store_backup(const char *path, const char *to, struct store_summary *summary, struct error *err);
/* The same, in place of a file `to` that may exist; after an error that file is as it was. */
status store_backup_over(const char *path, const char *to, struct error *err);

#endif
