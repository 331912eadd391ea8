#include "server/store/store.h"
#include "base/clock.h"
#include "server/store/store_sql.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/vfs.h>

static const char *const state_name[JOB_N_STATE] = {"draft",     "queued", "running",  "paused",
                                                    "succeeded", "failed", "cancelled"};

/* Entry i changes the schema from version i to version i + 1. */
static const char *const migration[] = {
    "CREATE TABLE job (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, sample TEXT NOT NULL, "
    "document TEXT NOT NULL,"
    " state INTEGER NOT NULL, cancel_requested INTEGER NOT NULL, dirty INTEGER NOT NULL, deleted INTEGER NOT NULL,"
    " attempt INTEGER NOT NULL, lost_attempts INTEGER NOT NULL, generation INTEGER NOT NULL, token TEXT NOT NULL,"
    " created REAL NOT NULL, updated REAL NOT NULL, queued REAL NOT NULL, started REAL NOT NULL, finished REAL NOT "
    "NULL,"
    " error_code TEXT NOT NULL, error_field TEXT NOT NULL, error_text TEXT NOT NULL, peak_rss INTEGER NOT NULL);"
    "CREATE INDEX job_state ON job (deleted, state, serial);"
    "CREATE TABLE file (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, job_id TEXT NOT NULL, name "
    "TEXT NOT NULL,"
    " role TEXT NOT NULL, size INTEGER NOT NULL, offset INTEGER NOT NULL, sha256 TEXT NOT NULL, state INTEGER NOT "
    "NULL, hash_state BLOB NOT NULL,"
    " UNIQUE (job_id, name));"
    "CREATE TABLE idempotency (key TEXT PRIMARY KEY, job_id TEXT NOT NULL, body_hash TEXT NOT NULL, created REAL NOT "
    "NULL);"
    "CREATE INDEX idempotency_job ON idempotency (job_id);"
    "CREATE TABLE probe (one INTEGER PRIMARY KEY, at REAL NOT NULL);",
};
enum { N_MIGRATION = sizeof migration / sizeof migration[0] };

const char *job_state_name(enum job_state state) { return state_name[state]; }

bool job_state_parse(const char *name, enum job_state *state)
{
    for (int i = 0; i < JOB_N_STATE; i++)
        if (strcmp(name, state_name[i]) == 0) {
            *state = (enum job_state)i;
            return true;
        }
    return false;
}

status store_error(struct store *store, const char *what, struct error *err)
{
    int code = sqlite3_errcode(store->db);
    status s = code == SQLITE_FULL                                                 ? STATUS_DISK_FULL
               : (sqlite3_extended_errcode(store->db) & 0xff) == SQLITE_CONSTRAINT ? STATUS_EXISTS
                                                                                   : STATUS_IO;
    return error_set(err, s, "%s: database says '%s'", what, sqlite3_errmsg(store->db));
}

static status bind_all(struct store *store, sqlite3_stmt *statement, struct error *err, const char *format,
                       va_list args)
{
    int rc = SQLITE_OK;
    for (int i = 1; *format != '\0' && rc == SQLITE_OK; format++, i++) {
        if (*format == 's')
            rc = sqlite3_bind_text(statement, i, va_arg(args, const char *), -1, SQLITE_TRANSIENT);
        else if (*format == 'i')
            rc = sqlite3_bind_int64(statement, i, va_arg(args, int64_t));
        else if (*format == 'd')
            rc = sqlite3_bind_double(statement, i, va_arg(args, double));
        else {
            const void *blob = va_arg(args, const void *);
            int n = va_arg(args, int);
            rc = sqlite3_bind_blob(statement, i, blob, n, SQLITE_TRANSIENT);
        }
    }
    return rc == SQLITE_OK ? STATUS_OK : store_error(store, "cannot bind a value", err);
}

static status prepare(struct store *store, sqlite3_stmt **statement, struct error *err, const char *sql,
                      const char *format, va_list args)
{
    if (sqlite3_prepare_v2(store->db, sql, -1, statement, NULL) != SQLITE_OK)
        return store_error(store, "cannot prepare a query", err);
    status s = bind_all(store, *statement, err, format, args);
    if (s != STATUS_OK) {
        sqlite3_finalize(*statement);
        *statement = NULL;
    }
    return s;
}

status store_prepare(struct store *store, sqlite3_stmt **statement, struct error *err, const char *sql,
                     const char *format, ...)
{
    va_list args;
    va_start(args, format);
    status s = prepare(store, statement, err, sql, format, args);
    va_end(args);
    return s;
}

status store_run(struct store *store, int *n_changed, struct error *err, const char *sql, const char *format, ...)
{
    sqlite3_stmt *statement = NULL;
    va_list args;
    va_start(args, format);
    status s = prepare(store, &statement, err, sql, format, args);
    va_end(args);
    if (s != STATUS_OK) return s;
    int rc;
    while ((rc = sqlite3_step(statement)) == SQLITE_ROW) {
    }
    if (rc != SQLITE_DONE) s = store_error(store, "cannot write to the database", err);
    if (n_changed != NULL) *n_changed = sqlite3_changes(store->db);
    sqlite3_finalize(statement);
    return s;
}

status store_begin(struct store *store, struct error *err)
{
    return store_run(store, NULL, err, "BEGIN IMMEDIATE", "");
}

status store_end(struct store *store, status so_far, struct error *err)
{
    if (so_far == STATUS_OK) so_far = store_run(store, NULL, err, "COMMIT", "");
    if (so_far != STATUS_OK) sqlite3_exec(store->db, "ROLLBACK", NULL, NULL, NULL);
    return so_far;
}

void store_text(sqlite3_stmt *statement, int column, char *out, size_t n_out)
{
    const unsigned char *text = sqlite3_column_text(statement, column);
    snprintf(out, n_out, "%s", text == NULL ? "" : (const char *)text);
}

static status refuse_network(const char *path, struct error *err)
{
    char folder[4096];
    snprintf(folder, sizeof folder, "%s", path);
    char *slash = strrchr(folder, '/');
    if (slash != NULL) *slash = '\0';
    struct statfs fs;
    if (statfs(slash == NULL ? "." : folder, &fs) != 0) return error_set_errno(err, "cannot examine '%s'", folder);
    static const unsigned long network[] = {0x6969, 0x517B, 0xFF534D42, 0xFE534D42, 0x5346414F, 0x00C36400, 0x01021997};
    for (size_t i = 0; i < sizeof network / sizeof network[0]; i++)
        if (((unsigned long)fs.f_type & 0xffffffffUL) == network[i])
            return error_set(err, STATUS_UNSUPPORTED,
                             "cannot keep the database in '%s': network file systems do not lock reliably", folder);
    return STATUS_OK;
}

static status read_version(struct store *store, int *version, struct error *err)
{
    sqlite3_stmt *statement;
    status s = store_prepare(store, &statement, err, "PRAGMA user_version", "");
    if (s != STATUS_OK) return s;
    if (sqlite3_step(statement) == SQLITE_ROW)
        *version = sqlite3_column_int(statement, 0);
    else
        s = store_error(store, "cannot read the database's version", err);
    sqlite3_finalize(statement);
    return s;
}

static status migrate(struct store *store, const char *path, struct error *err)
{
    int version = 0;
    status s = read_version(store, &version, err);
    if (s != STATUS_OK || version == N_MIGRATION) return s;
    if (version > N_MIGRATION)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot open database '%s': its version is %d, but this program supports versions up to %d",
                         path, version, N_MIGRATION);
    if (version > 0) {
        char backup[4096 + 32];
        snprintf(backup, sizeof backup, "%s.v%d", path, version);
        s = store_run(store, NULL, err, "VACUUM INTO ?", "s", backup);
        if (s != STATUS_OK) return error_prefix(err, s, "cannot back up the database before its migration");
    }
    for (; version < N_MIGRATION; version++) {
        char done[64];
        snprintf(done, sizeof done, "PRAGMA user_version=%d; COMMIT", version + 1);
        if (sqlite3_exec(store->db, "BEGIN IMMEDIATE", NULL, NULL, NULL) != SQLITE_OK ||
            sqlite3_exec(store->db, migration[version], NULL, NULL, NULL) != SQLITE_OK ||
            sqlite3_exec(store->db, done, NULL, NULL, NULL) != SQLITE_OK) {
            s = store_error(store, "cannot migrate the database", err);
            sqlite3_exec(store->db, "ROLLBACK", NULL, NULL, NULL);
            return s;
        }
    }
    return STATUS_OK;
}

status store_open(const char *path, struct store **out, struct error *err)
{
    status s = refuse_network(path, err);
    if (s != STATUS_OK) return s;
    struct store *store = calloc(1, sizeof *store);
    if (store == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot open the database: out of memory");
    pthread_mutex_init(&store->lock, NULL);
    if (sqlite3_open_v2(path, &store->db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, NULL) !=
        SQLITE_OK) {
        s = store_error(store, "cannot open the database", err);
        goto out;
    }
    sqlite3_busy_timeout(store->db, 5000);
    if (sqlite3_exec(
            store->db,
            "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON; PRAGMA trusted_schema=OFF", NULL,
            NULL, NULL) != SQLITE_OK) {
        s = store_error(store, "cannot set up the database", err);
        goto out;
    }
    s = migrate(store, path, err);
out:
    if (s != STATUS_OK) {
        store_close(store);
        return s;
    }
    *out = store;
    return STATUS_OK;
}

void store_close(struct store *store)
{
    if (store == NULL) return;
    sqlite3_close_v2(store->db);
    pthread_mutex_destroy(&store->lock);
    free(store);
}

status store_probe(struct store *store, struct error *err)
{
    pthread_mutex_lock(&store->lock);
    status s = store_run(store, NULL, err, "INSERT OR REPLACE INTO probe (one, at) VALUES (1, ?)", "d", clock_wall_s());
    pthread_mutex_unlock(&store->lock);
    return s;
}
