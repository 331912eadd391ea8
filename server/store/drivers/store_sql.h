/* Connections of a store, and the statements that run on them, whatever the driver (store_driver.h). */
#ifndef SELVEDGE_SERVER_STORE_SQL_H
#define SELVEDGE_SERVER_STORE_SQL_H

#include "server/store/drivers/store_driver.h"

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

/* Keeps other daemons from a row while this one changes it (store_cluster.h). link.lock is held by the thread behind
 * it. */
struct store_gate {
    struct store_link link; /* a connection of its own, because its locks last longer than a transaction */
    atomic_bool entered;
    _Atomic(pthread_t) thread; /* which has entered; set before entered is */
    status fault;              /* of this entry; it and why are that thread's */
    struct error why;
};

/* Sets err from the database's last failure. action: for example "cannot write job". */
status store_error(struct store_link *link, const char *action, struct error *err);
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
/* A transaction, while link->lock is held. store_end commits it, or rolls it back when so_far is an error or the
 * commit fails. */
status store_begin(struct store_link *link, struct error *err);
status store_end(struct store_link *link, status so_far, struct error *err);
/* STATUS_OK unless this thread is behind the gate (may be NULL) and its locks are not there. */
status store_gate_check(struct store_gate *gate, struct error *err);
/* Copies a text column into a buffer; NULL becomes "". */
void store_text(struct store_query *query, int column, char *out, size_t n_out);

#endif
