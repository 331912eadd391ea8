/* Inside the store: the connection and a few helpers around SQLite statements. */
#ifndef SELVEDGE_SERVER_STORE_SQL_H
#define SELVEDGE_SERVER_STORE_SQL_H

#include "server/store/store.h"

#include <pthread.h>
#include <sqlite3.h>

struct store {
    sqlite3 *db;
    pthread_mutex_t lock;
};

/* Translate SQLite's last result; what: "cannot write job". */
status store_error(struct store *store, const char *what, struct error *err);
/* Values are bound by format: s text, i int64_t, d double, b (pointer, int size) blob. */
status store_prepare(struct store *store, sqlite3_stmt **statement, struct error *err, const char *sql,
                     const char *format, ...);
/* Prepare, bind, run to the end. *n_changed may be NULL. */
status store_run(struct store *store, int *n_changed, struct error *err, const char *sql, const char *format, ...);
/* A transaction; end commits it, or undoes it when so_far or the commit itself failed. store->lock is held. */
status store_begin(struct store *store, struct error *err);
status store_end(struct store *store, status so_far, struct error *err);
/* store_job_update while store->lock is held. */
status store_job_write(struct store *store, struct job_row *row, struct error *err);
/* Column as text into a buffer; NULL becomes "". */
void store_text(sqlite3_stmt *statement, int column, char *out, size_t n_out);

#endif
