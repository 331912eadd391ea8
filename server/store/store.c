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

status store_error(struct store_link *link, const char *what, struct error *err)
{
    int code = sqlite3_errcode(link->db);
    status s = code == SQLITE_FULL                                                ? STATUS_DISK_FULL
               : (sqlite3_extended_errcode(link->db) & 0xff) == SQLITE_CONSTRAINT ? STATUS_EXISTS
                                                                                  : STATUS_IO;
    return error_set(err, s, "%s: database says '%s'", what, sqlite3_errmsg(link->db));
}

static status bind_all(struct store_link *link, sqlite3_stmt *statement, struct error *err, const char *format,
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
    return rc == SQLITE_OK ? STATUS_OK : store_error(link, "cannot bind a value", err);
}

static status prepare(struct store_link *link, sqlite3_stmt **statement, struct error *err, const char *sql,
                      const char *format, va_list args)
{
    if (sqlite3_prepare_v2(link->db, sql, -1, statement, NULL) != SQLITE_OK)
        return store_error(link, "cannot prepare a query", err);
    status s = bind_all(link, *statement, err, format, args);
    if (s != STATUS_OK) {
        sqlite3_finalize(*statement);
        *statement = NULL;
    }
    return s;
}

status store_prepare(struct store_link *link, sqlite3_stmt **statement, struct error *err, const char *sql,
                     const char *format, ...)
{
    va_list args;
    va_start(args, format);
    status s = prepare(link, statement, err, sql, format, args);
    va_end(args);
    return s;
}

status store_run(struct store_link *link, int *n_changed, struct error *err, const char *sql, const char *format, ...)
{
    sqlite3_stmt *statement = NULL;
    va_list args;
    va_start(args, format);
    status s = prepare(link, &statement, err, sql, format, args);
    va_end(args);
    if (s != STATUS_OK) return s;
    int rc;
    while ((rc = sqlite3_step(statement)) == SQLITE_ROW) {
    }
    if (rc != SQLITE_DONE) s = store_error(link, "cannot write to the database", err);
    if (n_changed != NULL) *n_changed = sqlite3_changes(link->db);
    sqlite3_finalize(statement);
    return s;
}

status store_begin(struct store_link *link, struct error *err)
{
    return store_run(link, NULL, err, "BEGIN IMMEDIATE", "");
}

status store_end(struct store_link *link, status so_far, struct error *err)
{
    if (so_far == STATUS_OK) so_far = store_run(link, NULL, err, "COMMIT", "");
    if (so_far != STATUS_OK) sqlite3_exec(link->db, "ROLLBACK", NULL, NULL, NULL);
    return so_far;
}

void store_text(sqlite3_stmt *statement, int column, char *out, size_t n_out)
{
    const unsigned char *text = sqlite3_column_text(statement, column);
    snprintf(out, n_out, "%s", text == NULL ? "" : (const char *)text);
}

status store_check_place(const char *path, struct error *err)
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

static status read_version(struct store_link *link, int *version, struct error *err)
{
    sqlite3_stmt *statement;
    status s = store_prepare(link, &statement, err, "PRAGMA user_version", "");
    if (s != STATUS_OK) return s;
    if (sqlite3_step(statement) == SQLITE_ROW)
        *version = sqlite3_column_int(statement, 0);
    else
        s = store_error(link, "cannot read the database's version", err);
    sqlite3_finalize(statement);
    return s;
}

static status migrate(struct store_link *link, const char *path, struct error *err)
{
    int version = 0, n_migration;
    const char *const *migration = store_migrations(&n_migration);
    status s = read_version(link, &version, err);
    if (s != STATUS_OK || version == n_migration) return s;
    if (version > n_migration)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot open database '%s': its version is %d, but this program supports versions up to %d",
                         path, version, n_migration);
    if (version > 0) {
        char backup[4096 + 32];
        snprintf(backup, sizeof backup, "%s.v%d", path, version);
        s = store_run(link, NULL, err, "VACUUM INTO ?", "s", backup);
        if (s != STATUS_OK) return error_prefix(err, s, "cannot back up the database before its migration");
    }
    for (; version < n_migration; version++) {
        char done[64];
        snprintf(done, sizeof done, "PRAGMA user_version=%d; COMMIT", version + 1);
        if (sqlite3_exec(link->db, "BEGIN IMMEDIATE", NULL, NULL, NULL) != SQLITE_OK ||
            sqlite3_exec(link->db, migration[version], NULL, NULL, NULL) != SQLITE_OK ||
            sqlite3_exec(link->db, done, NULL, NULL, NULL) != SQLITE_OK) {
            s = store_error(link, "cannot migrate the database", err);
            sqlite3_exec(link->db, "ROLLBACK", NULL, NULL, NULL);
            return s;
        }
    }
    return STATUS_OK;
}

/* Opens one connection. The second one of a file may only read: in WAL mode it waits neither for a change nor for the
 * sync that ends it, and sees every change whose call has returned. */
static status open_link(struct store_link *link, const char *path, int flags, const char *pragma, struct error *err)
{
    int rc = sqlite3_open_v2(path, &link->db, flags | SQLITE_OPEN_FULLMUTEX, NULL);
    if (rc == SQLITE_OK) sqlite3_busy_timeout(link->db, 5000);
    if (rc == SQLITE_OK) rc = sqlite3_exec(link->db, pragma, NULL, NULL, NULL);
    return rc == SQLITE_OK ? STATUS_OK : store_error(link, "cannot open the database", err);
}

/* A running daemon has migrated its database when it started. */
static status check_version(struct store_link *link, const char *path, struct error *err)
{
    int version = 0, n_migration;
    store_migrations(&n_migration);
    status s = read_version(link, &version, err);
    if (s != STATUS_OK || version == n_migration) return s;
    return error_set(err, STATUS_CONFLICT,
                     "database '%s' has version %d, and this program writes version %d: the daemon that uses it is of "
                     "another version; stop it first",
                     path, version, n_migration);
}

static status open_store(const char *path, int create,
                         status (*prepare_schema)(struct store_link *, const char *, struct error *),
                         struct store **out, struct error *err)
{
    status s = store_check_place(path, err);
    if (s != STATUS_OK) return s;
    struct store *store = calloc(1, sizeof *store);
    if (store == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot open the database: out of memory");
    pthread_mutex_init(&store->write.lock, NULL);
    pthread_mutex_init(&store->read.lock, NULL);
    s = open_link(&store->write, path, SQLITE_OPEN_READWRITE | create,
                  "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON; PRAGMA trusted_schema=OFF",
                  err);
    if (s == STATUS_OK) s = prepare_schema(&store->write, path, err);
    if (s == STATUS_OK) s = open_link(&store->read, path, SQLITE_OPEN_READONLY, "PRAGMA trusted_schema=OFF", err);
    if (s != STATUS_OK)
        store_close(store);
    else
        *out = store;
    return s;
}

status store_open(const char *path, struct store **out, struct error *err)
{
    return open_store(path, SQLITE_OPEN_CREATE, migrate, out, err);
}

status store_open_beside(const char *path, struct store **out, struct error *err)
{
    return open_store(path, 0, check_version, out, err);
}

void store_close(struct store *store)
{
    if (store == NULL) return;
    sqlite3_close_v2(store->read.db); /* first, so that the last connection can write and remove the WAL */
    sqlite3_close_v2(store->write.db);
    pthread_mutex_destroy(&store->read.lock);
    pthread_mutex_destroy(&store->write.lock);
    free(store);
}

void store_on_change(struct store *store, void (*changed)(void *context, const char *job_id), void *context)
{
    store->changed = changed;
    store->changed_context = context;
}

status store_report(const struct store *store, status s, const char *job_id)
{
    if (s == STATUS_OK && store->changed != NULL) store->changed(store->changed_context, job_id);
    return s;
}

status store_probe(struct store *store, struct error *err)
{
    pthread_mutex_lock(&store->write.lock);
    status s = store_run(&store->write, NULL, err, "INSERT OR REPLACE INTO probe (one, at) VALUES (1, ?)", "d",
                         clock_wall_s());
    pthread_mutex_unlock(&store->write.lock);
    return s;
}
