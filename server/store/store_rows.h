/* Internals of the store: its connections, and how rows of jobs and files are read and written. */
#ifndef SELVEDGE_SERVER_STORE_ROWS_H
#define SELVEDGE_SERVER_STORE_ROWS_H

#include "server/store/drivers/store_sql.h"
#include "server/store/store.h"

struct store {
    const struct store_driver *driver;
    struct store_place place;
    pthread_mutex_t name_lock;                          /* held for no statement */
    char daemon[STORE_ID_BYTES];                        /* id of this daemon; guarded by name_lock */
    struct store_link write, read;                      /* no function holds both locks */
    struct store_gate gate;                             /* without a connection unless the driver is shared */
    struct store_link lease;                            /* as gate; renews while a long change holds `write` */
    void (*changed)(void *context, const char *job_id); /* NULL: nobody asks */
    void *changed_context;
};

/* The columns of a job. document: JOB_DOCUMENT, or "NULL" where it is not needed, because it may have a megabyte. */
#define JOB_DOCUMENT "(SELECT text FROM document WHERE job_id = job.id)"
#define JOB_COLUMNS(document)                                                                                          \
    "serial, id, sample, " document                                                                                    \
    ", revision, state, cancel_requested, dirty, deleted, attempt, lost_attempts, generation, "                        \
    "token, created, updated, queued, started, finished, error_code, error_field, error_text, peak_rss, owner, "       \
    "priority, tags, verdict, batch, batch_place, "                                                                    \
    "CASE WHEN batch = '' THEN '' ELSE (SELECT name FROM batch WHERE batch.id = job.batch) END"

/* Writes a key of idempotency: owner, key, job, hash of the body, time. */
#define STORE_KEY_WRITE                                                                                                \
    "INSERT INTO idempotency (owner, key, job_id, body_hash, created) VALUES (?,?,?,?,?) ON CONFLICT (owner, key) DO " \
    "UPDATE SET job_id = excluded.job_id, body_hash = excluded.body_hash, created = excluded.created"

/* Copies the columns of JOB_COLUMNS to a row. STATUS_NO_MEMORY. */
status store_job_read(struct store_query *query, struct job_row *row, struct error *err);
/* For callers that hold store->write.lock, in their transaction: inserts a draft (as store_job_insert does), and
 * files. */
status store_job_add(struct store *store, struct job_row *row, const char *key, const char *body_hash,
                     struct error *err);
status store_file_add(struct store *store, const struct file_row *row, size_t n, struct error *err);
/* store_job_update for callers that hold store->write.lock. */
status store_job_write(struct store *store, struct job_row *row, struct error *err);
/* Reports a change of a job, unless s is an error. Returns s. To be called without locks. */
status store_report(const struct store *store, status s, const char *job_id);

#endif
