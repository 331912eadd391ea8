/* Internals of the store: its connections, and helpers around the statements of a driver (drivers/store_driver.h). */
#ifndef SELVEDGE_SERVER_STORE_SQL_H
#define SELVEDGE_SERVER_STORE_SQL_H

#include "server/store/sql/store_driver.h"
#include "server/store/store.h"

#include <pthread.h>
#include <stdatomic.h>

struct store_gate;

struct store_link {
    const struct store_calls *calls;
    void *db;
    const struct store_phrases *phrase;
    char application[STORE_APPLICATION_BYTES]; /* name of the connection at a server; guarded by lock */
    struct store_gate *gate; /* changes are refused while their thread is behind a gate that has failed; may be NULL */
    pthread_mutex_t lock;
};

/* Keeps other daemons from what is being changed (store_cluster.h). link.lock is held by the thread behind it. */
struct store_gate {
    struct store_link link; /* a connection of its own, because its locks last longer than a transaction */
    atomic_bool entered;
    _Atomic(pthread_t) thread; /* which has entered; set before entered is */
    status fault;              /* of this entry; it and why are that thread's */
    struct error why;
};

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

/* What is read of a job. document: JOB_DOCUMENT, or "NULL" where it is not needed, because it may have a megabyte. */
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

/* Sets err from the database's last failure; what is for example "cannot write job". */
status store_error(struct store_link *link, const char *what, struct error *err);
/* Starts a statement with values by format: s text, i int64_t, d double, b blob (pointer and int size). *query is NULL
 * after an error. The caller calls store_finish. */
status store_prepare(struct store_link *link, struct store_query **query, struct error *err, const char *sql,
                     const char *format, ...);
/* Runs a statement to the end. *n_changed may be NULL. */
status store_run(struct store_link *link, int *n_changed, struct error *err, const char *sql, const char *format, ...);
/* Runs a statement that ends with RETURNING and gives one number. */
status store_run_serial(struct store_link *link, int64_t *serial, struct error *err, const char *sql,
                        const char *format, ...);
/* Runs statements without values. */
status store_script(struct store_link *link, const char *sql, const char *what, struct error *err);
/* The next row of a statement, and its columns; query NULL: STORE_FAILED. */
enum store_step store_step(struct store_query *query);
bool store_is_null(struct store_query *query, int column);
int64_t store_int64(struct store_query *query, int column);
double store_real(struct store_query *query, int column);
const char *store_column_text(struct store_query *query, int column); /* NULL: null */
void store_finish(struct store_query *query);
/* Copies the columns of JOB_COLUMNS to a row. STATUS_NO_MEMORY. */
status store_job_read(struct store_query *query, struct job_row *row, struct error *err);
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
/* STATUS_OK unless this thread is behind the gate (may be NULL) and its locks are not there. */
status store_gate_check(struct store_gate *gate, struct error *err);
/* Statements of which entry i changes the schema of SQLite from version i to version i + 1. */
const char *const *store_migrations(int *n);
/* The same of PostgreSQL: lists of scripts, which NULL ends. */
const char *const *const *store_postgres_migrations(int *n);
/* Copies a text column into a buffer; NULL becomes "". */
void store_text(struct store_query *query, int column, char *out, size_t n_out);

#endif
