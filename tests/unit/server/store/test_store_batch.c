/* Batches in the database. */
#include "server/store/store_access.h"
#include "server/store/store_batch.h"
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

static const char batch_id[] = "11111111-1111-1111-1111-111111111111";

struct fixture {
    struct store_fixture db;
    struct store *store;
};

static void reopen(struct fixture *f)
{
    store_fixture_reopen(&f->db);
    f->store = f->db.store;
    assert_non_null(f->store);
}

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    if (f == NULL) return 1;
    *state = f;
    if (store_fixture_begin(&f->db) != 0) return 1;
    f->store = f->db.store;
    return 0;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    store_fixture_end(&f->db);
    free(f);
    return 0;
}

static struct batch_row batch_named(const char *id, const char *owner, const char *name)
{
    struct batch_row b = {.template_text = (char *)(uintptr_t) "{\"a\":1}"};
    snprintf(b.id, sizeof b.id, "%s", id);
    snprintf(b.owner, sizeof b.owner, "%s", owner);
    snprintf(b.name, sizeof b.name, "%s", name);
    return b;
}

static struct job_row job_of(const char *batch, const char *id, int64_t place)
{
    struct job_row row = {.state = JOB_DRAFT, .document = (char *)(uintptr_t) "{}", .batch_place = place};
    snprintf(row.id, sizeof row.id, "%s", id);
    snprintf(row.owner, sizeof row.owner, "ann");
    snprintf(row.batch, sizeof row.batch, "%s", batch);
    return row;
}

static void test_a_batch_and_its_jobs_are_written_together(void **state)
{
    struct fixture *f = *state;
    struct batch_row b = batch_named(batch_id, "ann", "weave"), found;
    struct job_row job[3] = {job_of(batch_id, "a", 1), job_of(batch_id, "b", 0), job_of(batch_id, "a", 2)};
    int64_t count[JOB_N_STATE];
    /* two jobs of one id: nothing is written */
    assert_int_equal(store_batch_write(f->store, &b, job, 3, NULL, 0, NULL), STATUS_EXISTS);
    assert_int_equal(store_batch_find(f->store, "ann", "weave", &found, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_job_look(f->store, "a", &job[2], NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_batch_write(f->store, &b, job, 2, NULL, 0, NULL), STATUS_OK);
    reopen(f);
    assert_int_equal(store_batch_find(f->store, "ann", "weave", &found, NULL), STATUS_OK);
    assert_string_equal(found.id, batch_id);
    assert_string_equal(found.template_text, "{\"a\":1}");
    batch_row_release(&found);
    assert_int_equal(store_batch_find(f->store, "bob", "weave", &found, NULL), STATUS_NOT_FOUND);
    const struct job_query q = {.batch = batch_id, .order = JOB_BY_PLACE, .ascending = true, .limit = 9};
    struct job_row *row = NULL;
    size_t n = 0;
    assert_int_equal(store_job_list(f->store, &q, &row, &n, NULL), STATUS_OK);
    assert_int_equal(n, 2);
    assert_string_equal(row[0].id, "b");
    assert_string_equal(row[1].batch_name, "weave");
    job_rows_free(row, n);
    assert_int_equal(store_batch_count(f->store, batch_id, count, NULL), STATUS_OK);
    assert_int_equal(count[JOB_DRAFT], 2);
    struct batch_row same = batch_named("22222222-2222-2222-2222-222222222222", "ann", "weave");
    assert_int_equal(store_batch_write(f->store, &same, NULL, 0, NULL, 0, NULL), STATUS_EXISTS);
}

static void test_erasing_a_batch_leaves_what_it_should(void **state)
{
    struct fixture *f = *state;
    struct batch_row b = batch_named(batch_id, "ann", "weave"), found;
    struct job_row job[2] = {job_of(batch_id, "a", 0), job_of(batch_id, "b", 1)}, row;
    struct owner_use use;
    assert_int_equal(store_batch_write(f->store, &b, job, 2, NULL, 0, NULL), STATUS_OK);
    job[0].batch[0] = job[1].batch[0] = '\0';
    job[1].deleted = true;
    assert_int_equal(store_batch_erase(f->store, batch_id, job, 2, NULL), STATUS_OK);
    reopen(f);
    assert_int_equal(store_batch_get(f->store, batch_id, &found, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_job_look(f->store, "a", &row, NULL), STATUS_OK);
    assert_string_equal(row.batch, "");
    assert_int_equal(store_owner_use(f->store, "ann", &use, NULL), STATUS_OK);
    assert_int_equal(use.jobs, 1);
}

/* The ids of the queue, and the last start of the first one's batch. */
static void expect_queue(struct fixture *f, size_t n_each, const char *ids, bool started)
{
    struct queued_job *job = NULL;
    size_t n = 0;
    char text[64] = "";
    assert_int_equal(store_job_queue(f->store, n_each, &job, &n, NULL), STATUS_OK);
    for (size_t i = 0; i < n; i++) strncat(text, job[i].id, sizeof text - strlen(text) - 1);
    assert_string_equal(text, ids);
    if (n > 0) assert_int_equal(job[n - 1].last_start_unix_s > 0, started);
    free(job);
}

static void test_the_queue_is_known_by_batch(void **state)
{
    struct fixture *f = *state;
    struct batch_row b = batch_named(batch_id, "ann", "weave");
    struct job_row job[4] = {job_of("", "x", 0), job_of(batch_id, "a", 0), job_of(batch_id, "b", 1),
                             job_of(batch_id, "c", 2)};
    assert_int_equal(store_batch_write(f->store, &b, job, 4, NULL, 0, NULL), STATUS_OK);
    expect_queue(f, 9, "", false);
    for (size_t i = 0; i < 4; i++) job[i].state = JOB_QUEUED;
    job[3].priority = 1;
    assert_int_equal(store_jobs_update(f->store, job, 4, NULL), STATUS_OK);
    expect_queue(f, 9, "xcab", false);
    expect_queue(f, 1, "xc", false);
    job[3].state = JOB_RUNNING;
    assert_int_equal(store_job_update(f->store, &job[3], NULL), STATUS_OK);
    expect_queue(f, 9, "xab", true);
    job[1].batch[0] = '\0'; /* leaves the batch while it is queued */
    assert_int_equal(store_job_update(f->store, &job[1], NULL), STATUS_OK);
    expect_queue(f, 9, "xab", true);
    expect_queue(f, 1, "xb", true);
    job[2].deleted = true;
    assert_int_equal(store_job_update(f->store, &job[2], NULL), STATUS_OK);
    expect_queue(f, 9, "xa", false);
    assert_int_equal(store_job_erase(f->store, "x", NULL), STATUS_OK);
    assert_int_equal(store_job_erase(f->store, "b", NULL), STATUS_OK);
    expect_queue(f, 9, "a", false);
}

/* A rebuild makes batches from what the journals of their jobs say. */
static void test_jobs_bring_their_batch_with_them(void **state)
{
    struct fixture *f = *state;
    struct batch_row found;
    struct job_row own = job_of(batch_id, "a", 3), foreign = job_of(batch_id, "b", 0), odd = job_of("short", "c", 0),
                   row;
    snprintf(own.batch_name, sizeof own.batch_name, "weave");
    snprintf(foreign.owner, sizeof foreign.owner, "bob");
    assert_int_equal(store_import(f->store, &own, NULL, 0, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(store_import(f->store, &foreign, NULL, 0, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(store_import(f->store, &odd, NULL, 0, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(store_batch_find(f->store, "ann", "weave", &found, NULL), STATUS_OK);
    assert_string_equal(found.id, batch_id);
    batch_row_release(&found);
    assert_int_equal(store_job_look(f->store, "a", &row, NULL), STATUS_OK);
    assert_string_equal(row.batch, batch_id);
    assert_int_equal(row.batch_place, 3);
    assert_int_equal(store_job_look(f->store, "b", &row, NULL), STATUS_OK);
    assert_string_equal(row.batch, "");
    assert_int_equal(store_job_look(f->store, "c", &row, NULL), STATUS_OK);
    assert_string_equal(row.batch, "");
}

/* A state that this version does not know is not counted, and nothing is written beyond the counts. */
static void test_an_unknown_state_is_not_counted(void **state)
{
    struct fixture *f = *state;
    struct batch_row b = batch_named(batch_id, "ann", "weave");
    struct job_row job[3] = {job_of(batch_id, "a", 0), job_of(batch_id, "b", 1), job_of(batch_id, "c", 2)};
    int64_t count[JOB_N_STATE + 1] = {0};
    char sql[80];
    count[JOB_N_STATE] = -7;
    assert_int_equal(store_batch_write(f->store, &b, job, 3, NULL, 0, NULL), STATUS_OK);
    snprintf(sql, sizeof sql, "UPDATE job SET state = %d WHERE id = 'b'", JOB_N_STATE);
    assert_int_equal(store_run(&f->store->write, NULL, NULL, sql, ""), STATUS_OK);
    assert_int_equal(store_batch_count(f->store, batch_id, count, NULL), STATUS_OK);
    assert_int_equal(count[JOB_DRAFT], 2);
    for (int i = 0; i < JOB_N_STATE; i++) assert_true(i == JOB_DRAFT || count[i] == 0);
    assert_int_equal(count[JOB_N_STATE], -7);
}

static int run(const char *database)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_a_batch_and_its_jobs_are_written_together, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_erasing_a_batch_leaves_what_it_should, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_the_queue_is_known_by_batch, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_jobs_bring_their_batch_with_them, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_an_unknown_state_is_not_counted, set_up, tear_down),
    };
    return cmocka_run_group_tests_name(database, tests, NULL, NULL);
}

int main(void) { return store_fixture_each(run); }
