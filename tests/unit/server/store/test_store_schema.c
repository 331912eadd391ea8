/* The schemas of the two kinds of databases: they have the same columns, and PostgreSQL's is migrated. */
#include "server/store/store_delivery.h"
#include "server/store/store_rows.h"
#include "tests/support/store/store_fixture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static int set_up(void **state)
{
    struct store_fixture *f = calloc(1, sizeof *f);
    *state = f;
    return f == NULL || store_fixture_begin(f) != 0;
}

static int tear_down(void **state)
{
    store_fixture_end(*state);
    free(*state);
    return 0;
}

/* Lists the columns of all tables as "table.column ", sorted by bytes. */
static void columns_of(struct store *store, const char *sql, char *out, size_t n_out)
{
    struct store_query *q = NULL;
    size_t n = 0;
    assert_int_equal(store_prepare(&store->read, &q, NULL, sql, ""), STATUS_OK);
    while (store_step(q) == STORE_ROW && n < n_out)
        n += (size_t)snprintf(out + n, n_out - n, "%s ", store_column_text(q, 0));
    store_finish(q);
}

static void test_both_databases_have_the_same_columns(void **state)
{
    struct store_fixture *f = *state;
    static char embedded[8192], shared[8192];
    char folder[] = "/tmp/selvedge-schema-XXXXXX", path[96];
    struct store *store = NULL;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/selvedge.db", folder);
    assert_int_equal(store_open(path, &store, NULL), STATUS_OK);
    /* job_count and owner_use are views of PostgreSQL, turn.queued is counted there, and the rest is about daemons */
    columns_of(
        store,
        "SELECT m.name || '.' || c.name FROM sqlite_schema m JOIN pragma_table_info(m.name) c WHERE m.type = 'table' "
        "AND m.name NOT LIKE 'sqlite%' AND m.name NOT IN ('job_count', 'owner_use') AND NOT (m.name = 'turn' AND "
        "c.name = 'queued') ORDER BY 1",
        embedded, sizeof embedded);
    columns_of(
        f->store,
        "SELECT (table_name || '.' || column_name) COLLATE \"C\" FROM information_schema.columns WHERE table_schema "
        "= 'public' AND table_name NOT IN ('job_count', 'owner_use', 'daemon', 'duty', 'identity', 'store_version') "
        "AND NOT (table_name = 'job' AND column_name = 'holder') ORDER BY 1",
        shared, sizeof shared);
    assert_true(strlen(embedded) > 500);
    assert_string_equal(embedded, shared);
    store_close(store);
    unlink(path);
    rmdir(folder);
}

static void add_running(struct store *store, const char *id)
{
    struct job_row row = {.state = JOB_DRAFT, .document = (char *)(uintptr_t) "{}"};
    snprintf(row.id, sizeof row.id, "%s", id);
    assert_int_equal(store_job_insert(store, &row, NULL, NULL, NULL), STATUS_OK);
    row.state = JOB_RUNNING;
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
}

static void succeed(struct store *store, const char *id)
{
    struct job_row row;
    assert_int_equal(store_job_look(store, id, &row, NULL), STATUS_OK);
    row.state = JOB_SUCCEEDED;
    snprintf(row.verdict, sizeof row.verdict, "good");
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
}

static void test_a_database_of_version_1_is_migrated(void **state)
{
    struct store_fixture *f = *state;
    struct delivery_row *d = NULL;
    size_t n = 0;
    add_running(f->store, "old");
    add_running(f->store, "new");
    assert_int_equal(store_webhook_enable(f->store, true, NULL), STATUS_OK);
    succeed(f->store, "old");
    assert_int_equal(store_script(&f->store->write,
                                  "ALTER TABLE delivery DROP COLUMN verdict; DROP TABLE share;"
                                  "DELETE FROM store_version WHERE version > 1",
                                  "cannot go back", NULL),
                     STATUS_OK);
    store_fixture_reopen(f);
    succeed(f->store, "new");
    assert_int_equal(store_delivery_list(f->store, NULL, NULL, 0, 10, &d, &n, NULL), STATUS_OK);
    assert_int_equal(n, 2);
    assert_string_equal(d[0].job_id, "new");
    assert_string_equal(d[0].verdict, "good");
    assert_string_equal(d[1].job_id, "old");
    assert_string_equal(d[1].verdict, "");
    free(d);
}

static int run(const char *database)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_both_databases_have_the_same_columns, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_a_database_of_version_1_is_migrated, set_up, tear_down),
    };
    return cmocka_run_group_tests_name(database, tests, NULL, NULL);
}

int main(void) { return store_fixture_shared(run); }
