/* Copies of a database, and what an examination finds. */
#include "server/store/drivers/store_backup.h"
#include "server/store/store.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

enum { N_JOB = 3, N_FILE = 2 };
static char path[200], copy[200], part[200];

static int set_up(void **state)
{
    struct store *store = NULL;
    if (scratch_folder_setup(state) != 0) return 1;
    snprintf(path, sizeof path, "%s", scratch_path(state, "test.db"));
    snprintf(copy, sizeof copy, "%s", scratch_path(state, "copy.db"));
    snprintf(part, sizeof part, "%s", scratch_path(state, "copy.db.part"));
    if (store_open(path, &store, NULL) != STATUS_OK) return 1;
    for (int i = 0; i < N_JOB + 1; i++) {
        struct job_row job = {.document = (char *)(uintptr_t) "{}", .created_unix_s = 5.0};
        snprintf(job.id, sizeof job.id, "job-%d", i);
        assert_int_equal(store_job_insert(store, &job, i == 0 ? "key" : NULL, "hash", NULL), STATUS_OK);
        job.deleted = i == N_JOB;
        if (job.deleted) assert_int_equal(store_job_update(store, &job, NULL), STATUS_OK);
    }
    struct file_row file[N_FILE] = {{.id = "1", .job_id = "job-0", .name = "a", .role = "volume"},
                                    {.id = "2", .job_id = "job-0", .name = "b", .role = "volume"}};
    assert_int_equal(store_file_insert(store, file, N_FILE, NULL, NULL), STATUS_OK);
    store_close(store);
    return 0;
}

static int tear_down(void **state) { return scratch_folder_teardown(state); }

static int64_t size_of(const char *name)
{
    struct stat st = {0};
    return stat(name, &st) == 0 ? (int64_t)st.st_size : -1;
}

static void change(const char *command)
{
    sqlite3 *db = NULL;
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    assert_int_equal(sqlite3_exec(db, command, NULL, NULL, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_close(db), SQLITE_OK);
}

static void assert_summary(const struct store_summary *s, int64_t n_bytes)
{
    assert_true(s->n_job == N_JOB && s->n_file == N_FILE && s->n_key == 1 && s->n_bytes == n_bytes && n_bytes > 0);
}

static void test_a_sound_database(void **state)
{
    (void)state;
    struct store_summary s = {0};
    for (int thorough = 0; thorough < 2; thorough++) {
        assert_int_equal(store_examine(path, thorough == 1, &s, NULL), STATUS_OK);
        assert_summary(&s, size_of(path));
    }
    assert_int_equal(store_examine(path, false, NULL, NULL), STATUS_OK);
    s = (struct store_summary){0};
    assert_int_equal(store_backup(path, copy, &s, NULL), STATUS_OK);
    assert_summary(&s, size_of(copy));
    assert_int_equal(store_examine(copy, true, &s, NULL), STATUS_OK);
    assert_summary(&s, size_of(copy));
    assert_int_equal(size_of(part), -1);
}

static void test_no_database(void **state)
{
    struct error err = {0};
    const char *none = scratch_path(state, "none.db");
    assert_int_equal(store_examine(none, false, NULL, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_backup(none, copy, NULL, &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "cannot back up the database to"));
    assert_true(size_of(copy) == -1 && size_of(part) == -1);
    scratch_write(path, "", 0);
    assert_int_equal(store_examine(path, false, NULL, &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, "has no tables"));
    scratch_write(path,
                  "this is no database, though it is long enough for its head to be looked at, and it says so "
                  "itself: whoever wrote it",
                  110);
    assert_int_equal(store_examine(path, false, NULL, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "is damaged: file is not a database"));
    assert_int_equal(store_backup(path, copy, NULL, &err), STATUS_FORMAT);
    assert_true(size_of(copy) == -1 && size_of(part) == -1);
}

static void test_content_that_cannot_be(void **state)
{
    (void)state;
    static const struct {
        const char *command, *why;
    } made[] = {{"DELETE FROM document WHERE job_id = 'job-1'", "jobs and documents differ in number"},
                {"UPDATE job_count SET n = n + 1", "its counts of jobs are wrong"},
                {"DROP TABLE idempotency", "no such table: idempotency"}};
    for (size_t i = 0; i < sizeof made / sizeof *made; i++) {
        struct error err = {0};
        if (i > 0) assert_int_equal(set_up(state), 0);
        change(made[i].command);
        assert_int_equal(store_examine(path, false, NULL, &err), STATUS_FORMAT);
        assert_non_null(strstr(err.text, made[i].why));
        assert_int_equal(store_backup(path, copy, NULL, &err), STATUS_FORMAT);
        assert_non_null(strstr(err.text, made[i].why));
        assert_true(size_of(copy) == -1 && size_of(part) == -1);
        if (i + 1 < sizeof made / sizeof *made) assert_int_equal(tear_down(state), 0);
    }
}

/* Only a thorough examination compares indexes with their tables. */
static void test_an_index_that_lacks_rows(void **state)
{
    (void)state;
    struct error err = {0};
    change("PRAGMA writable_schema = ON; CREATE INDEX extra ON job(sample); "
           "UPDATE sqlite_master SET sql = 'CREATE INDEX extra ON job(owner)' WHERE name = 'extra'; "
           "UPDATE job SET owner = 'somebody'");
    assert_int_equal(store_examine(path, false, NULL, NULL), STATUS_OK);
    assert_int_equal(store_examine(path, true, NULL, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "is damaged"));
}

static void test_a_file_is_in_the_way(void **state)
{
    (void)state;
    struct error err = {0};
    scratch_write(copy, "kept", 4);
    assert_int_equal(store_backup(path, copy, NULL, &err), STATUS_EXISTS);
    assert_int_equal(size_of(copy), 4);
    scratch_write(part, "left", 4); /* by a process that was killed */
    assert_int_equal(store_backup_over(path, copy, NULL), STATUS_OK);
    assert_int_equal(store_examine(copy, true, NULL, NULL), STATUS_OK);
    assert_int_equal(size_of(part), -1);
    assert_int_equal(mkdir(part, 0700), 0);
    assert_true(store_backup_over(path, copy, &err) != STATUS_OK);
    assert_non_null(strstr(err.text, "cannot remove"));
    assert_int_equal(store_examine(copy, true, NULL, NULL), STATUS_OK);
}

/* Only a migration keeps a copy of the database. */
static void test_an_open_of_the_present_version_copies_nothing(void **state)
{
    struct store *store = NULL;
    assert_int_equal(store_open(path, &store, NULL), STATUS_OK);
    store_close(store);
    assert_int_equal(scratch_count_entries(*state), 1);
}

/* Blocks of a disk that becomes full later: changes go to the WAL, whose blocks are reserved before its size grows. */
static void test_an_open_store_has_space_for_changes(void **state)
{
    struct store *store = NULL;
    struct stat st;
    assert_int_equal(store_open(path, &store, NULL), STATUS_OK);
    assert_int_equal(store_probe(store, NULL), STATUS_OK);
    assert_int_equal(stat(scratch_path(state, "test.db-wal"), &st), 0);
    assert_true(st.st_blocks * 512 > st.st_size + (1 << 16));
    store_close(store);
}

static void no_verdict(void *context, const char *id, char code[40]) { (void)context, (void)id, (void)code; }

/* Queries that were not finished would keep the connection, and with it the WAL, after the store is closed. */
static void test_a_store_that_is_closed_leaves_one_file(void **state)
{
    struct store *store = NULL;
    struct job_row *job = NULL;
    struct file_row *file = NULL;
    struct queued_job *queued = NULL;
    struct tag_count *tag = NULL;
    int64_t count[JOB_N_STATE], n_file = 0;
    size_t n = 0;
    assert_int_equal(store_open(path, &store, NULL), STATUS_OK);
    assert_int_equal(store_fill_verdicts(store, no_verdict, NULL, NULL), STATUS_OK);
    assert_int_equal(store_job_list(store, &(struct job_query){.limit = 9}, &job, &n, NULL), STATUS_OK);
    job_rows_free(job, n);
    assert_int_equal(store_file_list(store, "job-0", &file, &n, NULL), STATUS_OK);
    assert_int_equal(store_job_queue(store, 9, &queued, &n, NULL), STATUS_OK);
    assert_int_equal(store_tag_count(store, NULL, &tag, &n, NULL), STATUS_OK);
    assert_int_equal(store_job_count(store, count, NULL), STATUS_OK);
    assert_int_equal(store_file_count(store, "job-0", &n_file, NULL), STATUS_OK);
    free(file);
    free(queued);
    free(tag);
    store_close(store);
    assert_int_equal(scratch_count_entries(*state), 1);
}

struct ages {
    int n;
    double youngest_unix_s;
};

static void visit(void *context, const char *id, double updated_unix_s)
{
    struct ages *a = context;
    assert_memory_equal(id, "job-", 4);
    a->n++;
    if (updated_unix_s > a->youngest_unix_s) a->youngest_unix_s = updated_unix_s;
}

static void test_ages(void **state)
{
    struct ages a = {0};
    assert_int_equal(store_read_ages(path, visit, &a), STATUS_OK);
    assert_int_equal(a.n, N_JOB + 1); /* the tombstone, too */
    assert_true(a.youngest_unix_s > 5.0);
    assert_int_equal(store_read_ages(scratch_path(state, "none.db"), visit, &a), STATUS_NOT_FOUND);
    change("DROP TABLE job");
    assert_int_equal(store_read_ages(path, visit, &a), STATUS_FORMAT);
}

int main(void)
{
#define WITH_DATABASE(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
    const struct CMUnitTest tests[] = {WITH_DATABASE(test_a_sound_database),
                                       WITH_DATABASE(test_no_database),
                                       WITH_DATABASE(test_content_that_cannot_be),
                                       WITH_DATABASE(test_ages),
                                       WITH_DATABASE(test_an_index_that_lacks_rows),
                                       WITH_DATABASE(test_a_file_is_in_the_way),
                                       WITH_DATABASE(test_an_open_of_the_present_version_copies_nothing),
                                       WITH_DATABASE(test_an_open_store_has_space_for_changes),
                                       WITH_DATABASE(test_a_store_that_is_closed_leaves_one_file)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
