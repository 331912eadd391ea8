#include "server/store/drivers/store_backup.h"
#include "base/files/durable.h"
#include "server/store/drivers/store_schema.h"
#include "server/store/drivers/store_sql.h"

#include <errno.h>
#include <sqlite3.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_LIMIT_BYTES = 4096 };

struct reader {
    sqlite3 *db;
};

static status failed(struct reader *r, const char *what, struct error *err)
{
    status s = sqlite3_errcode(r->db) == SQLITE_FULL ? STATUS_DISK_FULL : STATUS_IO;
    return error_set(err, s, "%s: database says '%s'", what, sqlite3_errmsg(r->db));
}

/* Whether a result of SQLite says that the file is damaged, rather than that it could not be read. */
static bool means_damage(int rc)
{
    rc &= 0xff;
    /* SQLITE_ERROR: a table is missing or different */
    return rc == SQLITE_CORRUPT || rc == SQLITE_NOTADB || rc == SQLITE_ERROR || rc == SQLITE_FORMAT;
}

static status open_reader(const char *path, struct reader *r, struct error *err)
{
    struct stat st;
    if (stat(path, &st) != 0) return error_set_errno(err, "cannot read database '%s'", path);
    if (sqlite3_open_v2(path, &r->db, SQLITE_OPEN_READONLY | SQLITE_OPEN_FULLMUTEX, NULL) != SQLITE_OK)
        return failed(r, "cannot open the database", err);
    sqlite3_busy_timeout(r->db, 5000);
    return STATUS_OK;
}

static status damaged(const char *path, const char *why, struct error *err)
{
    return error_set(err, STATUS_FORMAT, "database '%s' is damaged: %s", path, why);
}

static status step_failed(struct reader *r, const char *path, struct error *err)
{
    if (means_damage(sqlite3_errcode(r->db))) return damaged(path, sqlite3_errmsg(r->db), err);
    return failed(r, "cannot examine the database", err);
}

/* Asks for one value; text is "" and number 0 when there is none. */
static status ask(struct reader *r, const char *path, const char *sql, int64_t *number, char text[256],
                  struct error *err)
{
    sqlite3_stmt *q = NULL;
    int rc = sqlite3_prepare_v2(r->db, sql, -1, &q, NULL);
    if (rc == SQLITE_OK) rc = sqlite3_step(q);
    status s = rc == SQLITE_ROW || rc == SQLITE_DONE ? STATUS_OK : step_failed(r, path, err);
    if (number != NULL) *number = rc == SQLITE_ROW ? sqlite3_column_int64(q, 0) : 0;
    if (text != NULL) text[0] = '\0';
    if (text != NULL && rc == SQLITE_ROW) {
        const char *found = (const char *)sqlite3_column_text(q, 0);
        snprintf(text, 256, "%s", found == NULL ? "" : found);
    }
    sqlite3_finalize(q);
    return s;
}

static status check_pages(struct reader *r, const char *path, bool thorough, struct error *err)
{
    char found[256];
    status s = ask(r, path, thorough ? "PRAGMA integrity_check(1)" : "PRAGMA quick_check(1)", NULL, found, err);
    if (s == STATUS_OK && strcmp(found, "ok") != 0) s = damaged(path, found, err);
    return s;
}

static status check_content(struct reader *r, const char *path, struct store_summary *out, struct error *err)
{
    /* the same snapshot for all */
    if (sqlite3_exec(r->db, "BEGIN", NULL, NULL, NULL) != SQLITE_OK) return step_failed(r, path, err);
    int64_t n_document = 0, n_counted = 0, n_all = 0;
    status s = ask(r, path, "SELECT count(*) FROM job WHERE deleted = 0", &out->n_job, NULL, err);
    if (s == STATUS_OK) s = ask(r, path, "SELECT count(*) FROM file", &out->n_file, NULL, err);
    if (s == STATUS_OK) s = ask(r, path, "SELECT count(*) FROM idempotency", &out->n_key, NULL, err);
    if (s == STATUS_OK)
        s = ask(r, path, "SELECT count(*) FROM job JOIN document ON job_id = job.id", &n_document, NULL, err);
    if (s == STATUS_OK) s = ask(r, path, "SELECT count(*) FROM job", &n_all, NULL, err);
    if (s == STATUS_OK) s = ask(r, path, "SELECT coalesce(sum(n), 0) FROM job_count", &n_counted, NULL, err);
    if (s == STATUS_OK && n_document != n_all) s = damaged(path, "jobs and documents differ in number", err);
    if (s == STATUS_OK && n_counted != out->n_job) s = damaged(path, "its counts of jobs are wrong", err);
    sqlite3_exec(r->db, "COMMIT", NULL, NULL, NULL);
    return s;
}

status store_examine(const char *path, bool thorough, struct store_summary *summary, struct error *err)
{
    struct reader reader = {0};
    struct store_summary found = {0};
    struct stat st = {0};
    int64_t version = 0;
    status s = open_reader(path, &reader, err);
    if (s == STATUS_OK) s = ask(&reader, path, "PRAGMA user_version", &version, NULL, err);
    if (s == STATUS_OK && version == 0) s = error_set(err, STATUS_NOT_FOUND, "database '%s' has no tables", path);
    if (s == STATUS_OK) s = check_pages(&reader, path, thorough, err);
    /* the migration adds the parts that older versions lack */
    int n_version = 0;
    store_migrations(&n_version);
    if (s == STATUS_OK && version == n_version) s = check_content(&reader, path, &found, err);
    sqlite3_close_v2(reader.db);
    if (stat(path, &st) == 0) found.n_bytes = (int64_t)st.st_size;
    if (s == STATUS_OK && summary != NULL) *summary = found;
    return s;
}

status store_read_ages(const char *path, void (*visit)(void *context, const char *id, double updated_unix_s),
                       void *context)
{
    struct reader r = {0};
    sqlite3_stmt *q = NULL;
    status s = open_reader(path, &r, NULL);
    int rc = s == STATUS_OK ? sqlite3_prepare_v2(r.db, "SELECT id, updated FROM job", -1, &q, NULL) : SQLITE_OK;
    while (s == STATUS_OK && rc != SQLITE_DONE) {
        if (rc == SQLITE_OK || rc == SQLITE_ROW) rc = sqlite3_step(q);
        if (rc == SQLITE_ROW)
            visit(context, (const char *)sqlite3_column_text(q, 0), sqlite3_column_double(q, 1));
        else if (rc != SQLITE_DONE)
            s = step_failed(&r, path, NULL);
    }
    sqlite3_finalize(q);
    sqlite3_close_v2(r.db);
    return s;
}

static status vacuum(struct reader *r, const char *to, struct error *err)
{
    sqlite3_stmt *q = NULL;
    int rc = sqlite3_prepare_v2(r->db, "VACUUM INTO ?", -1, &q, NULL);
    if (rc == SQLITE_OK) rc = sqlite3_bind_text(q, 1, to, -1, SQLITE_TRANSIENT);
    if (rc == SQLITE_OK) rc = sqlite3_step(q);
    status s = rc == SQLITE_DONE ? STATUS_OK : failed(r, "cannot write to the database", err);
    sqlite3_finalize(q);
    return s;
}

static status copy(const char *path, const char *to, struct error *err)
{
    struct reader reader = {0};
    status s = open_reader(path, &reader, err);
    if (s == STATUS_OK) s = vacuum(&reader, to, err);
    if (s != STATUS_OK && reader.db != NULL && means_damage(sqlite3_errcode(reader.db)))
        s = damaged(path, sqlite3_errmsg(reader.db), err);
    sqlite3_close_v2(reader.db);
    return s;
}

/* Makes the copy under a temporary name first, and removes an unfinished copy of a killed process under that name. */
static status make_copy(const char *path, const char *to, struct store_summary *summary, struct error *err)
{
    static const char *const left[] = {"", "-journal"}; /* SQLite may keep a journal beside a file that it writes */
    char part[PATH_LIMIT_BYTES], old[PATH_LIMIT_BYTES + 16];
    if (snprintf(part, sizeof part, "%s.part", to) >= (int)sizeof part)
        return error_set(err, STATUS_INVALID, "path '%.200s' is too long", to);
    for (size_t i = 0; i < sizeof left / sizeof left[0]; i++) {
        snprintf(old, sizeof old, "%s%s", part, left[i]);
        if (unlink(old) != 0 && errno != ENOENT) return error_set_errno(err, "cannot remove '%s'", old);
    }
    status s = copy(path, part, err);
    if (s == STATUS_OK) s = store_examine(part, true, summary, err);
    if (s == STATUS_OK) s = durable_rename(part, to, err);
    if (s != STATUS_OK) unlink(part);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot back up the database to '%s'", to);
}

status store_backup(const char *path, const char *to, struct store_summary *summary, struct error *err)
{
    struct stat st;
    if (lstat(to, &st) == 0) return error_set(err, STATUS_EXISTS, "'%s' exists already", to);
    return make_copy(path, to, summary, err);
}

status store_backup_over(const char *path, const char *to, struct error *err) { return make_copy(path, to, NULL, err); }
