/* PostgreSQL as the database of several daemons. libpq is reached through a plug-in, so that no other service needs
 * it. */
#include "base/process.h"
#include "server/store/drivers/driver_table.h"
#include "server/store/drivers/store_schema.h"
#include "server/store/drivers/store_sql.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH_LIMIT_BYTES = 4096, LEAST_VERSION = 130000, SCHEMA_LOCK = 7878001 };

#define PLUGIN "selvedge-postgresql.so"

/* The plug-in is beside the libraries of the build, or where an installation has it. Tests name its folder. */
static void *open_plugin(char why[STORE_WHY_BYTES])
{
    static const char *const below[] = {"/../lib/selvedge/", "/../lib/"};
    char program[PATH_LIMIT_BYTES], path[PATH_LIMIT_BYTES + 64];
    const char *folder = getenv("SELVEDGE_PLUGINS");
    if (folder != NULL) {
        snprintf(path, sizeof path, "%.4000s/" PLUGIN, folder);
        void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (library == NULL) snprintf(why, STORE_WHY_BYTES, "%s", dlerror());
        return library;
    }
    program_folder(program, sizeof program);
    snprintf(why, STORE_WHY_BYTES, "'" PLUGIN "' is not installed");
    for (size_t i = 0; i < sizeof below / sizeof below[0]; i++) {
        snprintf(path, sizeof path, "%s%s" PLUGIN, program, below[i]);
        if (access(path, F_OK) != 0) continue;
        void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
        if (library == NULL) snprintf(why, STORE_WHY_BYTES, "%s", dlerror());
        return library;
    }
    return NULL;
}

static status load(const struct store_calls **calls, struct error *err)
{
    char why[STORE_WHY_BYTES] = "";
    void *library = open_plugin(why); /* stays loaded until the program ends */
    if (library == NULL)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot use PostgreSQL: %s; install the package libpq5 (to build it: libpq-dev, and make)",
                         why);
    *calls = dlsym(library, STORE_CALLS_SYMBOL);
    if (*calls == NULL || (*calls)->version != STORE_CALLS_VERSION)
        return error_set(err, STATUS_UNSUPPORTED, "cannot use PostgreSQL: '" PLUGIN "' is of another version");
    return STATUS_OK;
}

/* Asks for one value. */
static status ask(struct store_link *link, const char *sql, char *text, size_t n_text, struct error *err)
{
    struct store_query *q = NULL;
    status s = store_prepare(link, &q, err, sql, "");
    text[0] = '\0';
    enum store_step step = s == STATUS_OK ? store_step(q) : STORE_DONE;
    if (step == STORE_ROW) store_text(q, 0, text, n_text);
    if (step == STORE_FAILED) s = store_error(link, "cannot examine the database", err);
    store_finish(q);
    return s;
}

static status check_server(struct store_link *link, struct error *err)
{
    char version[32], encoding[64];
    status s = ask(link, "SELECT current_setting('server_version_num')", version, sizeof version, err);
    if (s == STATUS_OK) s = ask(link, "SELECT current_setting('server_encoding')", encoding, sizeof encoding, err);
    if (s != STATUS_OK) return s;
    if (strtol(version, NULL, 10) < LEAST_VERSION)
        return error_set(err, STATUS_UNSUPPORTED, "the server is PostgreSQL %ld, but 13 or newer is needed",
                         strtol(version, NULL, 10) / 10000);
    if (strcmp(encoding, "UTF8") != 0)
        return error_set(err, STATUS_UNSUPPORTED,
                         "the encoding of the database is %s, but UTF8 is needed: createdb --encoding=UTF8 "
                         "--template=template0",
                         encoding);
    return STATUS_OK;
}

static status read_version(struct store_link *link, long *version, struct error *err)
{
    char text[32];
    status s = ask(link, "SELECT to_regclass('store_version') IS NOT NULL", text, sizeof text, err);
    *version = 0;
    if (s != STATUS_OK || text[0] != 't') return s;
    s = ask(link, "SELECT max(version) FROM store_version", text, sizeof text, err);
    *version = strtol(text, NULL, 10);
    return s;
}

static status migrate_one(struct store_link *link, long from, const char *const *sql, struct error *err)
{
    status s = store_begin(link, err);
    if (s != STATUS_OK) return s;
    if (from == 0)
        s = store_script(link, "CREATE TABLE store_version (version BIGINT PRIMARY KEY)",
                         "cannot make the tables of the database", err);
    for (; s == STATUS_OK && *sql != NULL; sql++) s = store_script(link, *sql, "cannot migrate the database", err);
    if (s == STATUS_OK)
        s = store_run(link, NULL, err, "INSERT INTO store_version (version) VALUES (?)", "i", (int64_t)from + 1);
    return store_end(link, s, err);
}

static status migrate(struct store_link *link, bool may_migrate, struct error *err)
{
    int n = 0;
    long version = 0;
    const char *const *const *migration = store_postgres_migrations(&n);
    status s = read_version(link, &version, err);
    if (s != STATUS_OK || version == n) return s;
    if (version > n)
        return error_set(err, STATUS_UNSUPPORTED,
                         "the database has version %ld, and this program writes version %d: use the program that made "
                         "it",
                         version, n);
    if (!may_migrate && version == 0)
        return error_set(err, STATUS_CONFLICT, "the database has no tables yet; the first daemon makes them");
    if (!may_migrate)
        return error_set(err, STATUS_CONFLICT,
                         "the database has version %ld, and this program writes version %d: start a daemon to migrate "
                         "it",
                         version, n);
    for (; s == STATUS_OK && version < n; version++) s = migrate_one(link, version, migration[version], err);
    return s;
}

static status prepare(struct store_link *link, const char *address, bool may_migrate, struct error *err)
{
    (void)address; /* it may have a password */
    status s = check_server(link, err);
    if (s != STATUS_OK) return s;
    s = store_run(link, NULL, err, "SELECT pg_advisory_lock(?)", "i", (int64_t)SCHEMA_LOCK);
    if (s != STATUS_OK) return s;
    s = migrate(link, may_migrate, err);
    store_run(link, NULL, NULL, "SELECT pg_advisory_unlock(?)", "i", (int64_t)SCHEMA_LOCK);
    return s;
}

const struct store_driver store_postgres = {
    .id = "postgresql.v1",
    .scheme = "postgres",
    .shared = true,
    .phrase = {.begin = "BEGIN",
               .sample_key = "lower(sample)",
               .queue = "SELECT j.id, t.owner, t.batch, j.priority, j.queued, coalesce(u.last, 0) FROM (SELECT "
                        "DISTINCT owner, batch FROM job WHERE deleted = 0 AND state = 1) t LEFT JOIN turn u ON "
                        "u.owner = t.owner AND u.batch = t.batch CROSS JOIN LATERAL (SELECT h.id, h.priority, "
                        "h.queued, h.serial FROM job h WHERE h.deleted = 0 AND h.state = 1 AND h.owner = t.owner AND "
                        "h.batch = t.batch ORDER BY h.priority DESC, h.queued, h.serial LIMIT ?) j "
                        "ORDER BY t.owner, t.batch, j.priority DESC, j.queued, j.serial"},
    .load = load,
    .prepare = prepare};
