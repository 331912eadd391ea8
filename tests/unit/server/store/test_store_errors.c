/* A database that has lost its tables while it is open: every function of the store says so, and none says OK with
 * nothing in its hands. */
#include "server/store/store_access.h"
#include "server/store/store_batch.h"
#include "server/store/store_delivery.h"
#include "server/store/store_rows.h"
#include "tests/support/scratch_folder.h"

#include <errno.h>
#include <setjmp.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static const char id[] = "11111111-1111-1111-1111-111111111111";
static const unsigned char hash[STORE_SECRET_HASH_BYTES] = {1};

static void drop_tables(const char *path)
{
    sqlite3 *db = NULL;
    sqlite3_stmt *q = NULL;
    char name[64][64], command[100];
    size_t n = 0;
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, "PRAGMA foreign_keys = OFF", NULL, NULL, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_prepare_v2(db,
                                        "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE "
                                        "'sqlite_%'",
                                        -1, &q, NULL),
                     SQLITE_OK);
    while (n < 64 && sqlite3_step(q) == SQLITE_ROW)
        snprintf(name[n++], sizeof *name, "%s", (const char *)sqlite3_column_text(q, 0));
    sqlite3_finalize(q);
    assert_true(n > 8);
    for (size_t i = 0; i < n; i++) {
        snprintf(command, sizeof command, "DROP TABLE \"%s\"", name[i]);
        assert_int_equal(sqlite3_exec(db, command, NULL, NULL, NULL), SQLITE_OK);
    }
    assert_int_equal(sqlite3_close(db), SQLITE_OK);
}

static struct store *opened;

static int set_up(void **state)
{
    char path[200];
    if (scratch_folder_setup(state) != 0) return 1;
    snprintf(path, sizeof path, "%s", scratch_path(state, "test.db"));
    if (store_open(path, &opened, NULL) != STATUS_OK) return 1;
    drop_tables(path);
    return 0;
}

static int tear_down(void **state)
{
    store_close(opened);
    return scratch_folder_teardown(state);
}

/* The error names the table that is missing. */
#define FAILS(call)                                                                                                    \
    do {                                                                                                               \
        struct error err = {0};                                                                                        \
        if ((call) == STATUS_OK) fail_msg("no error: %s", #call);                                                      \
        if (strstr(err.text, "no such table") == NULL) fail_msg("%s: %s", #call, err.text);                            \
    } while (0)

static void test_jobs(void **state)
{
    (void)state;
    struct job_row row = {.id = "a", .document = (char *)(uintptr_t) "{}", .state = JOB_SUCCEEDED}, *rows = NULL;
    struct job_query q = {.limit = 3};
    struct queued_job *queued = NULL;
    struct tag_count *tag = NULL;
    char text[STORE_HASH_TEXT_BYTES], found[STORE_ID_BYTES];
    int64_t count[JOB_N_STATE];
    size_t n = 0;
    FAILS(store_job_insert(opened, &row, NULL, NULL, &err));
    FAILS(store_job_insert(opened, &row, "key", "hash", &err));
    FAILS(store_idempotency_find(opened, "ann", "key", found, text, &err));
    FAILS(store_job_get(opened, id, &row, &err));
    FAILS(store_job_look(opened, id, &row, &err));
    row = (struct job_row){.id = "a", .document = (char *)(uintptr_t) "{}", .state = JOB_SUCCEEDED};
    FAILS(store_job_update(opened, &row, &err));
    FAILS(store_job_replace(opened, &row, &err));
    FAILS(store_jobs_update(opened, &row, 1, &err));
    FAILS(store_job_erase(opened, id, &err));
    FAILS(store_job_list(opened, &q, &rows, &n, &err));
    q.tag = "t";
    q.order = JOB_BY_SAMPLE;
    FAILS(store_job_list(opened, &q, &rows, &n, &err));
    FAILS(store_job_queue(opened, 2, &queued, &n, &err));
    FAILS(store_fill_verdicts(opened, NULL, NULL, &err));
    FAILS(store_tag_count(opened, NULL, &tag, &n, &err));
    FAILS(store_job_version_bytes(opened, id, 5, &err));
    FAILS(store_job_count(opened, count, &err));
    FAILS(store_import(opened, &row, NULL, 0, NULL, NULL, &err));
    FAILS(store_probe(opened, &err));
    assert_true(rows == NULL && queued == NULL && tag == NULL);
}

static void test_files(void **state)
{
    (void)state;
    struct file_row row = {.id = "f", .job_id = "a", .name = "a.tif"}, *rows = NULL;
    struct job_row job = {.id = "a"};
    int64_t n_file = 0;
    size_t n = 0;
    FAILS(store_file_insert(opened, &row, 1, NULL, &err));
    FAILS(store_file_insert(opened, &row, 1, &job, &err));
    FAILS(store_file_get(opened, id, &row, &err));
    FAILS(store_file_find(opened, id, "a.tif", &row, &err));
    FAILS(store_file_known(opened, "ann", "aa", 5, &row, &err));
    FAILS(store_file_update(opened, &row, &err));
    FAILS(store_file_erase(opened, id, NULL, &err));
    FAILS(store_file_erase(opened, id, &job, &err));
    FAILS(store_file_count(opened, id, &n_file, &err));
    FAILS(store_file_list(opened, id, &rows, &n, &err));
    FAILS(store_file_list(opened, NULL, &rows, &n, &err));
    assert_null(rows);
}

static void test_batches(void **state)
{
    (void)state;
    struct batch_row batch = {.id = "b", .template_text = (char *)(uintptr_t) "{}"}, *rows = NULL;
    struct job_row job = {.id = "a", .document = (char *)(uintptr_t) "{}"};
    int64_t count[JOB_N_STATE];
    size_t n = 0;
    FAILS(store_batch_write(opened, &batch, NULL, 0, NULL, 0, &err));
    FAILS(store_batch_write(opened, &batch, &job, 1, NULL, 0, &err));
    FAILS(store_batch_erase(opened, id, NULL, 0, &err));
    FAILS(store_batch_get(opened, id, &batch, &err));
    FAILS(store_batch_find(opened, "ann", "night", &batch, &err));
    FAILS(store_batch_list(opened, NULL, 0, 5, &rows, &n, &err));
    FAILS(store_batch_count(opened, id, count, &err));
    FAILS(store_batch_owner(opened, id, (char[STORE_OWNER_BYTES]){0}, &err));
    assert_null(rows);
}

static void test_access(void **state)
{
    (void)state;
    struct token_row row = {.id = "t", .name = "ann", .owner = "ann", .scope = ACCESS_READ}, *rows = NULL;
    struct owner_use use;
    char owner[STORE_OWNER_BYTES];
    bool any = false;
    size_t n = 0;
    FAILS(store_token_any(opened, &any, &err));
    FAILS(store_token_insert(opened, &row, &err));
    FAILS(store_token_find(opened, hash, false, 1, &row, &err));
    FAILS(store_token_find(opened, hash, true, 1, &row, &err));
    FAILS(store_token_get(opened, "ann", &row, &err));
    FAILS(store_token_revoke(opened, id, 1, &err));
    FAILS(store_token_used(opened, &row, 1, &err));
    FAILS(store_token_list(opened, 0, 5, &rows, &n, &err));
    FAILS(store_session_insert(opened, hash, id, 1, 2, &err));
    FAILS(store_session_erase(opened, hash, &err));
    FAILS(store_access_rebuilt(opened, true, 1, &err));
    FAILS(store_job_owner(opened, id, owner, &err));
    FAILS(store_upload_owner(opened, id, owner, &err));
    FAILS(store_owner_use(opened, "ann", &use, &err));
    assert_null(rows);
}

static void test_deliveries(void **state)
{
    (void)state;
    struct delivery_row row = {.id = "d"}, *rows = NULL;
    size_t n = 0;
    FAILS(store_webhook_enable(opened, true, &err));
    FAILS(store_webhook_enable(opened, false, &err));
    FAILS(store_delivery_next(opened, &row, &err));
    FAILS(store_delivery_update(opened, &row, &err));
    FAILS(store_delivery_list(opened, NULL, NULL, 0, 5, &rows, &n, &err));
    FAILS(store_delivery_prune(opened, 5, &err));
    assert_null(rows);
}

/* Nothing is written of a job whose row cannot be written. */
static void test_a_job_without_its_table(void **state)
{
    struct store *store = NULL;
    sqlite3 *db = NULL;
    struct job_row row = {.id = "a", .document = (char *)(uintptr_t) "{}"};
    const char *path = scratch_path(state, "other.db");
    assert_int_equal(store_open(path, &store, NULL), STATUS_OK);
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, "PRAGMA foreign_keys = OFF; DROP TABLE job", NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(db);
    assert_true(store_job_insert(store, &row, NULL, NULL, NULL) != STATUS_OK);
    store_close(store);
}

/* A change whose transaction does not begin, here because another one is open, is an error. */
static void test_a_change_that_cannot_begin(void **state)
{
    struct store *store = NULL;
    struct job_row row = {.id = "a", .document = (char *)(uintptr_t) "{}"};
    assert_int_equal(store_open(scratch_path(state, "begin.db"), &store, NULL), STATUS_OK);
    assert_int_equal(store_job_insert(store, &row, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(store_begin(&store->write, NULL), STATUS_OK);
    assert_true(store_job_replace(store, &row, NULL) != STATUS_OK);
    assert_true(store_import(store, &row, NULL, 0, NULL, NULL, NULL) != STATUS_OK);
    assert_int_equal(store_end(&store->write, STATUS_OK, NULL), STATUS_OK);
    store_close(store);
}

/* A job is not imported without the batch that it names. */
static void test_a_batch_that_cannot_be_imported(void **state)
{
    struct store *store = NULL;
    struct job_row row = {.id = "a", .owner = "ann", .document = (char *)(uintptr_t) "{}"}, found;
    assert_int_equal(store_open(scratch_path(state, "batch.db"), &store, NULL), STATUS_OK);
    assert_int_equal(sqlite3_exec(store->write.db,
                                  "CREATE TRIGGER no_batch BEFORE INSERT ON batch BEGIN SELECT RAISE(ABORT, 'no'); END",
                                  NULL, NULL, NULL),
                     SQLITE_OK);
    snprintf(row.batch, sizeof row.batch, "%s", id);
    assert_true(store_import(store, &row, NULL, 0, NULL, NULL, NULL) != STATUS_OK);
    assert_int_equal(store_job_look(store, "a", &found, NULL), STATUS_NOT_FOUND);
    store_close(store);
}

static void fail_with(sqlite3_context *context, int n, sqlite3_value **value)
{
    (void)n;
    sqlite3_result_error_code(context, SQLITE_IOERR);
    errno = sqlite3_value_int(value[0]);
}

/* An I/O error means a full disk only where the system says so. */
static void test_an_io_error_is_told_from_a_full_disk(void **state)
{
    struct store *store = NULL;
    char why[200] = "", command[60];
    const int number[] = {EIO, ENOSPC};
    assert_int_equal(store_open(scratch_path(state, "io.db"), &store, NULL), STATUS_OK);
    sqlite3 *db = store->write.db;
    assert_int_equal(
        sqlite3_create_function(db, "fail_with", 1, SQLITE_UTF8 | SQLITE_DIRECTONLY, NULL, fail_with, NULL, NULL),
        SQLITE_OK);
    for (size_t i = 0; i < 2; i++) {
        snprintf(command, sizeof command, "SELECT fail_with(%d)", number[i]);
        assert_int_equal(sqlite3_exec(db, command, NULL, NULL, NULL), SQLITE_IOERR);
        assert_int_equal(sqlite3_system_errno(db), number[i]);
        assert_int_equal(store->write.calls->fault(db, why, sizeof why), i == 0 ? STATUS_IO : STATUS_DISK_FULL);
        assert_string_equal(why, sqlite3_errstr(i == 0 ? SQLITE_IOERR : SQLITE_FULL));
    }
    store_close(store);
}

int main(void)
{
#define BROKEN(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {BROKEN(test_jobs),
                                       BROKEN(test_files),
                                       BROKEN(test_batches),
                                       BROKEN(test_access),
                                       BROKEN(test_deliveries),
                                       BROKEN(test_a_job_without_its_table),
                                       BROKEN(test_a_change_that_cannot_begin),
                                       BROKEN(test_a_batch_that_cannot_be_imported),
                                       BROKEN(test_an_io_error_is_told_from_a_full_disk)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
