/* SQLite, embedded: the database of a single daemon, with WAL and synchronous=FULL. */
#include "server/store/drivers/driver_table.h"
#include "server/store/drivers/store_backup.h"
#include "server/store/drivers/store_schema.h"
#include "server/store/drivers/store_sql.h"

#include <errno.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/vfs.h>
#include <unistd.h>

/* SQLite checkpoints after 1,000 pages of 4096 bytes, each with 24 bytes before it; a change may take some more. */
enum { WAL_BYTES = 1100 * (4096 + 24), WAL_SMALL_BYTES = 1 << 20, STATEMENT_MOST = 64 };

struct sqlite_query {
    struct store_query base;
    sqlite3_stmt *statement;
    sqlite3 *db;
};

extern const struct store_calls store_sqlite_calls;

static sqlite3_stmt *statement_of(struct store_query *query)
{
    return ((struct sqlite_query *)(void *)query)->statement;
}

static status check_place(const char *path, struct error *err)
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

static status open_db(const struct store_place *place, const char *application, bool only_reads, bool create,
                      void **out)
{
    sqlite3 *db = NULL;
    int access = only_reads ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | (create ? SQLITE_OPEN_CREATE : 0);
    const char *pragma =
        only_reads
            ? "PRAGMA trusted_schema=OFF"
            : "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA foreign_keys=ON; PRAGMA trusted_schema=OFF";
    (void)application;
    int rc = sqlite3_open_v2(place->address, &db, access | SQLITE_OPEN_FULLMUTEX, NULL);
    if (rc == SQLITE_OK) sqlite3_busy_timeout(db, 5000);
    if (rc == SQLITE_OK) rc = sqlite3_exec(db, pragma, NULL, NULL, NULL);
    *out = db;
    return rc == SQLITE_OK ? STATUS_OK : STATUS_IO;
}

static void close_db(void *db)
{
    for (sqlite3_stmt *s; (s = sqlite3_next_stmt(db, NULL)) != NULL;) sqlite3_finalize(s);
    sqlite3_close_v2(db);
}

static status script(void *db, const char *sql)
{
    return sqlite3_exec(db, sql, NULL, NULL, NULL) == SQLITE_OK ? STATUS_OK : STATUS_IO;
}

static int bind(sqlite3_stmt *statement, int i, const struct store_value *v)
{
    if (v->kind == 'i') return sqlite3_bind_int64(statement, i, v->integer);
    if (v->kind == 'd') return sqlite3_bind_double(statement, i, v->real);
    if (v->kind == 's')
        return sqlite3_bind_text(statement, i, v->bytes, v->bytes == NULL ? -1 : (int)v->n_bytes, SQLITE_TRANSIENT);
    return sqlite3_bind_blob(statement, i, v->bytes, (int)v->n_bytes, SQLITE_TRANSIENT);
}

/* A statement of an earlier change of the same text, or a new one. Preparing a change of a job compiles its triggers,
 * too, and takes several times as long as running it. */
static int take_statement(sqlite3 *db, const char *sql, sqlite3_stmt **statement)
{
    for (sqlite3_stmt *s = sqlite3_next_stmt(db, NULL); s != NULL; s = sqlite3_next_stmt(db, s))
        if (!sqlite3_stmt_readonly(s) && !sqlite3_stmt_busy(s) && strcmp(sqlite3_sql(s), sql) == 0) {
            *statement = s;
            return SQLITE_OK;
        }
    return sqlite3_prepare_v2(db, sql, -1, statement, NULL);
}

/* Keeps the statement of a change, which has a fixed text, for take_statement. */
static void give_back_statement(sqlite3 *db, sqlite3_stmt *statement)
{
    size_t n = 0;
    for (sqlite3_stmt *s = sqlite3_next_stmt(db, NULL); s != NULL; s = sqlite3_next_stmt(db, s)) n++;
    if (statement == NULL || sqlite3_stmt_readonly(statement) || n > STATEMENT_MOST) {
        sqlite3_finalize(statement);
        return;
    }
    sqlite3_reset(statement);
    sqlite3_clear_bindings(statement);
}

static status query(void *db, const char *sql, const struct store_value *value, size_t n, struct store_query **out)
{
    sqlite3_stmt *statement = NULL;
    int rc = take_statement(db, sql, &statement);
    for (size_t i = 0; rc == SQLITE_OK && i < n; i++) rc = bind(statement, (int)i + 1, &value[i]);
    struct sqlite_query *q = rc == SQLITE_OK ? calloc(1, sizeof *q) : NULL;
    if (q == NULL) {
        give_back_statement(db, statement);
        return STATUS_IO;
    }
    *q = (struct sqlite_query){{&store_sqlite_calls}, statement, db};
    *out = &q->base;
    return STATUS_OK;
}

static enum store_step step(struct store_query *query)
{
    int rc = sqlite3_step(statement_of(query));
    return rc == SQLITE_ROW ? STORE_ROW : rc == SQLITE_DONE ? STORE_DONE : STORE_FAILED;
}

static bool is_null(struct store_query *query, int column)
{
    return sqlite3_column_type(statement_of(query), column) == SQLITE_NULL;
}
static int64_t integer(struct store_query *query, int column)
{
    return sqlite3_column_int64(statement_of(query), column);
}
static double real(struct store_query *query, int column) { return sqlite3_column_double(statement_of(query), column); }
static const char *text(struct store_query *query, int column)
{
    return (const char *)sqlite3_column_text(statement_of(query), column);
}

static const void *blob(struct store_query *query, int column, size_t *n)
{
    const void *bytes = sqlite3_column_blob(statement_of(query), column);
    *n = (size_t)sqlite3_column_bytes(statement_of(query), column);
    return bytes;
}

static int64_t n_changed(struct store_query *query)
{
    return sqlite3_changes(((struct sqlite_query *)(void *)query)->db);
}

static void finish(struct store_query *query)
{
    struct sqlite_query *q = (struct sqlite_query *)(void *)query;
    give_back_statement(q->db, q->statement);
    free(query);
}

static status fault(void *db, char *why, size_t n_why)
{
    /* a file of shared memory that cannot grow is an "I/O error" */
    const int code = sqlite3_extended_errcode(db) & 0xff;
    const bool full = code == SQLITE_FULL || (code == SQLITE_IOERR && sqlite3_system_errno(db) == ENOSPC);
    snprintf(why, n_why, "%s", full ? sqlite3_errstr(SQLITE_FULL) : sqlite3_errmsg(db));
    return full ? STATUS_DISK_FULL : code == SQLITE_CONSTRAINT ? STATUS_EXISTS : STATUS_IO;
}

static bool is_alive(void *db) { return db != NULL; }

const struct store_calls store_sqlite_calls = {
    STORE_CALLS_VERSION, open_db, close_db, script,  query, step, is_null, integer, real, text, blob,
    n_changed,           finish,  fault,    is_alive};

static status load(const struct store_calls **calls, struct error *err)
{
    (void)err;
    *calls = &store_sqlite_calls;
    return STATUS_OK;
}

static status read_version(struct store_link *link, int *version, struct error *err)
{
    struct store_query *q = NULL;
    status s = store_prepare(link, &q, err, "PRAGMA user_version", "");
    if (s == STATUS_OK && store_step(q) == STORE_ROW)
        *version = (int)store_int64(q, 0);
    else if (s == STATUS_OK)
        s = store_error(link, "cannot read the database's version", err);
    store_finish(q);
    return s;
}

/* Copies the database to <path>.v<version>. An older copy of this name is left from a killed start or from an upgrade
 * that was taken back; the database may have changed since, so the copy is made anew. */
static status keep_old_version(const char *path, int version, struct error *err)
{
    char backup[4096 + 32];
    snprintf(backup, sizeof backup, "%s.v%d", path, version);
    status s = store_backup_over(path, backup, err);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot migrate the database from version %d", version);
}

/* All migrations are one transaction, so a killed start leaves the old version or the new one. */
static status migrate(struct store_link *link, const char *path, struct error *err)
{
    static const char what[] = "cannot migrate the database";
    int version = 0, n_migration;
    const char *const *migration = store_migrations(&n_migration);
    status s = read_version(link, &version, err);
    if (s != STATUS_OK || version == n_migration) return s;
    if (version > n_migration)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot open database '%s': its version is %d, but this program supports versions up to %d",
                         path, version, n_migration);
    if (version > 0) s = keep_old_version(path, version, err);
    if (s == STATUS_OK) s = store_script(link, link->phrase->begin, what, err);
    if (s != STATUS_OK) return s;
    char done[64];
    snprintf(done, sizeof done, "PRAGMA user_version=%d; COMMIT", n_migration);
    while (s == STATUS_OK && version < n_migration) s = store_script(link, migration[version++], what, err);
    if (s == STATUS_OK) s = store_script(link, done, what, err);
    if (s != STATUS_OK) script(link->db, "ROLLBACK");
    return s;
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

int64_t store_sqlite_log_bytes(int64_t n_free)
{
    int64_t most = n_free - n_free / 4, n = n_free / 8;
    if (n < WAL_SMALL_BYTES) n = most < WAL_SMALL_BYTES ? most : WAL_SMALL_BYTES;
    return n > WAL_BYTES ? WAL_BYTES : n;
}

/* Reserves blocks for the WAL up to its usual end, so that changes succeed on a disk that becomes full. The
 * size of the file stays, so SQLite does not see it. */
static void reserve_wal(const char *path)
{
    char wal[4096 + 8];
    struct statfs fs;
    snprintf(wal, sizeof wal, "%s-wal", path);
    int fd = open(wal, O_WRONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd >= 0 && fstatfs(fd, &fs) == 0) {
        int64_t n = store_sqlite_log_bytes((int64_t)fs.f_bavail * (int64_t)fs.f_bsize);
        if (n > 0 && fallocate(fd, FALLOC_FL_KEEP_SIZE, 0, (off_t)n) != 0) {
            /* changes may then find the disk full, and say so */
        }
    }
    if (fd >= 0) close(fd);
}

/* After a checkpoint the next change overwrites the WAL from its beginning. */
static void make_room(struct store_link *link, const char *path)
{
    script(link->db, "PRAGMA wal_checkpoint(RESTART)");
    reserve_wal(path);
}

static status prepare(struct store_link *link, const char *address, bool may_migrate, struct error *err)
{
    if (!may_migrate) return check_version(link, address, err);
    status s = migrate(link, address, err);
    if (s == STATUS_OK) reserve_wal(address);
    return s;
}

const struct store_driver store_sqlite = {
    .id = "sqlite.v1",
    .scheme = "",
    .phrase = {.begin = "BEGIN IMMEDIATE",
               .sample_key = "sample COLLATE NOCASE",
               .queue = "SELECT j.id, t.owner, t.batch, j.priority, j.queued, t.last FROM turn t CROSS JOIN job j ON "
                        "j.serial IN (SELECT h.serial FROM job h WHERE h.deleted = 0 AND h.state = 1 AND "
                        "h.owner = t.owner AND h.batch = t.batch ORDER BY h.priority DESC, h.queued, h.serial LIMIT ?) "
                        "WHERE t.queued > 0 ORDER BY t.owner, t.batch, j.priority DESC, j.queued, j.serial"},
    .load = load,
    .check_place = check_place,
    .prepare = prepare,
    .make_room = make_room};
