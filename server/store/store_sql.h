/* Internals of the store: its two connections, and helpers around SQLite statements. */
#ifndef SELVEDGE_SERVER_STORE_SQL_H
#define SELVEDGE_SERVER_STORE_SQL_H

#include "server/store/store.h"

#include <pthread.h>
#include <sqlite3.h>

struct store_link {
    sqlite3 *db;
    pthread_mutex_t lock;
};

struct store {
    struct store_link write, read;                      /* no function holds both locks */
    void (*changed)(void *context, const char *job_id); /* NULL: nobody asks */
    void *changed_context;
};

/* What is read of a job. document: JOB_DOCUMENT, or "NULL" where it is not needed, because it may have a megabyte. */
#define JOB_DOCUMENT "(SELECT text FROM document WHERE job_id = job.id)"
#define JOB_COLUMNS(document)                                                                                          \
    "serial, id, sample, " document                                                                                    \
    ", revision, state, cancel_requested, dirty, deleted, attempt, lost_attempts, generation, "                        \
    "token, created, updated, queued, started, finished, error_code, error_field, error_text, peak_rss, owner, "       \
    "priority, tags, verdict, batch, batch_place, "                                                                    \
    "CASE WHEN batch = '' THEN '' ELSE (SELECT name FROM batch WHERE batch.id = job.batch) END"

/* Sets err from SQLite's last result; what is for example "cannot write job". */
status store_error(struct store_link *link, const char *what, struct error *err);
/* Prepares a statement and binds the values by format: s text, i int64_t, d double, b blob (pointer and int size). */
status store_prepare(struct store_link *link, sqlite3_stmt **statement, struct error *err, const char *sql,
                     const char *format, ...);
/* Prepares a statement, binds its values and runs it to the end. *n_changed may be NULL. */
status store_run(struct store_link *link, int *n_changed, struct error *err, const char *sql, const char *format, ...);
/* Copies the columns of JOB_COLUMNS to a row. STATUS_NO_MEMORY. */
status store_job_read(sqlite3_stmt *statement, struct job_row *row, struct error *err);
/* A transaction, while link->lock is held. store_end commits it, or rolls it back when so_far is an error or the
 * commit fails. */
status store_begin(struct store_link *link, struct error *err);
status store_end(struct store_link *link, status so_far, struct error *err);
/* For callers that hold store->write.lock, in their transaction: inserts a draft (as store_job_insert does), and
 * files. */
status store_job_add(struct store *store, struct job_row *row, const char *key, const char *body_hash,
                     struct error *err);
status store_file_add(struct store *store, const struct file_row *row, size_t n, struct error *err);
/* store_job_update for callers that hold store->write.lock. */
status store_job_write(struct store *store, struct job_row *row, struct error *err);
/* Reports a change of a job, unless s is an error. Returns s. To be called without locks. */
status store_report(const struct store *store, status s, const char *job_id);
/* Statements of which entry i changes the schema from version i to version i + 1. */
const char *const *store_migrations(int *n);
/* Copies a text column into a buffer; NULL becomes "". */
void store_text(sqlite3_stmt *statement, int column, char *out, size_t n_out);

#endif
