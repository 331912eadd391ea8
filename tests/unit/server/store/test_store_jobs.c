/* Jobs in the database: every column comes back as it was written, and lists have the jobs that were asked for, in
 * order and page by page. With SQLite and with PostgreSQL. */
#include "base/clock.h"
#include "server/store/store.h"
#include "tests/support/store/store_fixture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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

/* "00000003-....": n tells jobs apart. */
static void make_id(int n, char id[STORE_ID_BYTES])
{
    snprintf(id, STORE_ID_BYTES, "%08x-0000-4000-8000-000000000000", (unsigned)n);
}

static struct job_row add(struct store *store, int n, const char *sample, const char *owner, double created_unix_s)
{
    struct job_row row = {.state = JOB_DRAFT, .document = (char *)(uintptr_t) "{}", .created_unix_s = created_unix_s};
    make_id(n, row.id);
    snprintf(row.sample, sizeof row.sample, "%s", sample);
    snprintf(row.owner, sizeof row.owner, "%s", owner);
    assert_int_equal(store_job_insert(store, &row, NULL, NULL, NULL), STATUS_OK);
    row.document = NULL;
    return row;
}

static void assert_same(const struct job_row *a, const struct job_row *b)
{
    assert_string_equal(a->sample, b->sample);
    assert_int_equal(a->state, b->state);
    assert_true(a->cancel_requested == b->cancel_requested && a->dirty == b->dirty && a->deleted == b->deleted);
    assert_true(a->attempt == b->attempt && a->lost_attempts == b->lost_attempts && a->generation == b->generation);
    assert_string_equal(a->token, b->token);
    assert_true(a->queued_unix_s == b->queued_unix_s && a->started_unix_s == b->started_unix_s);
    assert_true(a->finished_unix_s == b->finished_unix_s && a->created_unix_s == b->created_unix_s);
    assert_string_equal(a->error_code, b->error_code);
    assert_string_equal(a->error_field, b->error_field);
    assert_string_equal(a->error_text, b->error_text);
    assert_true(a->peak_rss_bytes == b->peak_rss_bytes && a->priority == b->priority);
    assert_string_equal(a->owner, b->owner);
    assert_string_equal(a->tags, b->tags);
    assert_string_equal(a->verdict, b->verdict);
    assert_true(a->batch_place == b->batch_place);
}

static void test_every_column(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row row = add(store, 1, "first", "ann", 1000.25), got;
    const struct job_row changed = {.state = JOB_FAILED,
                                    .sample = "Öther 'name'",
                                    .cancel_requested = true,
                                    .dirty = true,
                                    .attempt = 3,
                                    .lost_attempts = 2,
                                    .generation = 5,
                                    .token = "t0ken",
                                    .created_unix_s = 1000.25,
                                    .queued_unix_s = 1001.5,
                                    .started_unix_s = 1002.5,
                                    .finished_unix_s = 1003.5,
                                    .error_code = "format",
                                    .error_field = "volume.files",
                                    .error_text = "page 2",
                                    .peak_rss_bytes = 1LL << 40,
                                    .owner = "ann",
                                    .priority = -4,
                                    .tags = " a b ",
                                    .verdict = "good",
                                    .batch_place = 7};
    assert_int_equal(store_job_look(store, row.id, &got, NULL), STATUS_OK);
    assert_same(&got, &row);
    const int64_t revision = got.revision, serial = got.serial;
    assert_true(serial > 0 && serial == row.serial && got.updated_unix_s == 1000.25);
    row = changed;
    make_id(1, row.id);
    for (int flag = 0; flag < 3; flag++) { /* each flag alone, so that none stands for another */
        row.cancel_requested = flag == 0;
        row.dirty = flag == 1;
        row.deleted = flag == 2;
        const double before = clock_wall_s();
        assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
        assert_int_equal(store_job_look(store, row.id, &got, NULL), STATUS_OK);
        assert_same(&got, &row);
        assert_true(got.revision == revision + flag + 1 && got.serial == serial && got.document == NULL);
        assert_true(got.updated_unix_s >= before && got.updated_unix_s == row.updated_unix_s);
    }
    row.document = (char *)(uintptr_t) "{\"sample\":\"new\"}";
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
    assert_int_equal(store_job_get(store, row.id, &got, NULL), STATUS_OK);
    assert_string_equal(got.document, "{}"); /* update leaves the document */
    job_row_release(&got);
    assert_null(got.document);
    assert_int_equal(store_job_replace(store, &row, NULL), STATUS_OK);
    assert_int_equal(store_job_get(store, row.id, &got, NULL), STATUS_OK);
    assert_string_equal(got.document, "{\"sample\":\"new\"}");
    assert_true(got.revision == revision + 5);
    job_row_release(&got);
}

static void test_jobs_that_do_not_exist(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row row = add(store, 1, "x", "", 1), none = row, got;
    struct error err = {0};
    make_id(2, none.id);
    none.document = (char *)(uintptr_t) "{}";
    assert_int_equal(store_job_get(store, none.id, &got, &err), STATUS_NOT_FOUND);
    assert_non_null(strstr(err.text, none.id));
    assert_int_equal(store_job_look(store, none.id, &got, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_job_update(store, &none, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_job_replace(store, &none, NULL), STATUS_NOT_FOUND);
    struct job_row both[2] = {row, none};
    both[0].state = JOB_QUEUED;
    assert_int_equal(store_jobs_update(store, both, 2, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_job_look(store, row.id, &got, NULL), STATUS_OK);
    assert_int_equal(got.state, JOB_DRAFT); /* all or none */
    none = add(store, 2, "y", "", 2);
    both[1].state = JOB_RUNNING;
    assert_int_equal(store_jobs_update(store, both, 2, NULL), STATUS_OK);
    assert_int_equal(store_jobs_update(store, both, 0, NULL), STATUS_OK);
    assert_int_equal(store_job_look(store, none.id, &got, NULL), STATUS_OK);
    assert_int_equal(got.state, JOB_RUNNING);
    int64_t n[JOB_N_STATE];
    assert_int_equal(store_job_count(store, n, NULL), STATUS_OK);
    for (int s = 0; s < JOB_N_STATE; s++) assert_int_equal(n[s], s == JOB_QUEUED || s == JOB_RUNNING);
    assert_int_equal(store_job_erase(store, row.id, NULL), STATUS_OK);
    assert_int_equal(store_job_look(store, row.id, &got, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_job_count(store, n, NULL), STATUS_OK);
    assert_int_equal(n[JOB_QUEUED], 0);
}

/* A key belongs to its owner, and is free again when its job is gone. */
static void test_keys(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row row = {
        .state = JOB_DRAFT, .document = (char *)(uintptr_t) "{}", .owner = "ann", .created_unix_s = 1};
    char id[STORE_ID_BYTES], hash[STORE_HASH_TEXT_BYTES];
    make_id(1, row.id);
    assert_int_equal(store_job_insert(store, &row, "key", "abc", NULL), STATUS_OK);
    assert_int_equal(store_idempotency_find(store, "ann", "key", id, hash, NULL), STATUS_OK);
    assert_string_equal(id, row.id);
    assert_string_equal(hash, "abc");
    assert_int_equal(store_idempotency_find(store, "bob", "key", id, hash, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_idempotency_find(store, "ann", "other", id, hash, NULL), STATUS_NOT_FOUND);
    row.deleted = true;
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
    assert_int_equal(store_idempotency_find(store, "ann", "key", id, hash, NULL), STATUS_NOT_FOUND);
    row.deleted = false;
    assert_int_equal(store_job_erase(store, row.id, NULL), STATUS_OK);
    assert_int_equal(store_job_insert(store, &row, NULL, NULL, NULL), STATUS_OK);
    assert_int_equal(store_idempotency_find(store, "ann", "key", id, hash, NULL), STATUS_NOT_FOUND);
}

/* Fails unless the list has the jobs with these numbers, in this order. */
static void expect(struct store *store, const struct job_query *query, size_t n_want, const int *want)
{
    struct job_query q = *query;
    struct job_row *row = NULL;
    char id[STORE_ID_BYTES];
    size_t n = 0;
    if (q.limit == 0) q.limit = 100;
    assert_int_equal(store_job_list(store, &q, &row, &n, NULL), STATUS_OK);
    if (n != n_want) fail_msg("%zu jobs, not %zu", n, n_want);
    for (size_t i = 0; i < n; i++) {
        make_id(want[i], id);
        assert_string_equal(row[i].id, id);
        assert_null(row[i].document);
    }
    job_rows_free(row, n);
}

#define EXPECT(store, query, ...)                                                                                      \
    do {                                                                                                               \
        const struct job_query q_ = query;                                                                             \
        const int want_[] = {__VA_ARGS__};                                                                             \
        expect(store, &q_, sizeof want_ / sizeof *want_, want_);                                                       \
    } while (0)
#define QUERY(...) ((struct job_query){__VA_ARGS__})

static void fill(struct store *store)
{
    static const char *const sample[] = {"Silk A", "wool b", "SILK c", "Ärmel"};
    static const enum job_state in[] = {JOB_SUCCEEDED, JOB_FAILED, JOB_QUEUED, JOB_SUCCEEDED};
    static const char *const tags[] = {" red ", " red blue ", " redder ", ""};
    static const char *const verdict[] = {"good", "", "", "usable"};
    const double finished[] = {50, 70, 0, 60};
    for (int i = 0; i < 4; i++) {
        struct job_row row = add(store, i + 1, sample[i], i % 2 == 0 ? "ann" : "bob", 100.0 * (i + 1));
        row.state = in[i];
        snprintf(row.tags, sizeof row.tags, "%s", tags[i]);
        snprintf(row.verdict, sizeof row.verdict, "%s", verdict[i]);
        row.finished_unix_s = finished[i];
        assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
    }
    struct job_row gone = add(store, 5, "silk", "ann", 500);
    gone.deleted = true;
    assert_int_equal(store_job_update(store, &gone, NULL), STATUS_OK);
}

static void test_selections(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    fill(store);
    EXPECT(store, QUERY(.limit = 100), 4, 3, 2, 1);
    EXPECT(store, QUERY(.limit = 2), 4, 3);
    EXPECT(store, QUERY(.deleted = true), 5);
    EXPECT(store, QUERY(.states = 1U << JOB_SUCCEEDED), 4, 1);
    EXPECT(store, QUERY(.states = 1U << JOB_SUCCEEDED | 1U << JOB_FAILED), 4, 2, 1);
    EXPECT(store, QUERY(.owner = "bob"), 4, 2);
    EXPECT(store, QUERY(.sample = "sILk"), 3, 1);
    expect(store, &QUERY(.sample = "Z"), 0, NULL);
    EXPECT(store, QUERY(.sample = "Ärm"), 4);
    EXPECT(store, QUERY(.id = "00000002"), 2);
    EXPECT(store, QUERY(.id = "0000000"), 4, 3, 2, 1);
    EXPECT(store, QUERY(.tag = "red"), 2, 1);
    EXPECT(store, QUERY(.verdict = ",good,usable,"), 4, 1);
    EXPECT(store, QUERY(.verdict = ",,"), 3, 2);
    EXPECT(store, QUERY(.created_after_unix_s = 200), 4, 3, 2);
    EXPECT(store, QUERY(.created_before_unix_s = 200), 1);
    EXPECT(store, QUERY(.created_after_unix_s = 200, .created_before_unix_s = 300), 2);
    EXPECT(store, QUERY(.states = 1U << JOB_SUCCEEDED, .owner = "ann", .sample = "a", .tag = "red"), 1);
}

/* Order, and where the list goes on behind a job. */
static void test_orders_and_pages(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row row;
    char id[STORE_ID_BYTES];
    fill(store);
    make_id(1, id);
    assert_int_equal(store_job_look(store, id, &row, NULL), STATUS_OK);
    const int64_t first = row.serial;
    EXPECT(store, QUERY(.ascending = true), 1, 2, 3, 4);
    EXPECT(store, QUERY(.after_serial = first + 2), 2, 1);
    EXPECT(store, QUERY(.after_serial = first + 1, .ascending = true), 3, 4);
    EXPECT(store, QUERY(.order = JOB_BY_END), 2, 4, 1, 3);
    EXPECT(store, QUERY(.order = JOB_BY_END, .ascending = true), 3, 1, 4, 2);
    EXPECT(store, QUERY(.order = JOB_BY_END, .after_serial = first + 3, .after_key = "60"), 1, 3);
    EXPECT(store, QUERY(.order = JOB_BY_END, .ascending = true, .after_serial = first, .after_key = "50"), 4, 2);
    EXPECT(store, QUERY(.order = JOB_BY_END, .after_serial = first + 5, .after_key = "60"), 4, 1, 3);
    EXPECT(store, QUERY(.order = JOB_BY_SAMPLE, .ascending = true), 1, 3, 2, 4);
    EXPECT(store, QUERY(.order = JOB_BY_SAMPLE), 4, 2, 3, 1);
    EXPECT(store, QUERY(.order = JOB_BY_SAMPLE, .ascending = true, .after_serial = first + 2, .after_key = "SILK c"), 2,
           4);
    EXPECT(store, QUERY(.order = JOB_BY_SAMPLE, .after_serial = first + 1, .after_key = "WOOL b"), 3, 1);
}

/* More rows than the first allocation has room for. */
static void test_many(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    int want[40];
    for (int i = 0; i < 40; i++) {
        add(store, i + 1, "x", "", i + 1);
        want[39 - i] = i + 1;
    }
    expect(store, &QUERY(.limit = 40), 40, want);
    expect(store, &QUERY(.limit = 17), 17, want);
}

/* The queue of each owner: by priority, then by time, and when the owner had a start last. */
static void test_the_queue(void **state)
{
    static const struct {
        const char *owner;
        enum job_state state;
        int64_t priority;
        double queued;
    } job[] = {{"ann", JOB_QUEUED, 1, 10}, {"ann", JOB_QUEUED, 5, 30}, {"ann", JOB_QUEUED, 5, 20},
               {"bob", JOB_QUEUED, 0, 5},  {"bob", JOB_RUNNING, 9, 1}, {"cid", JOB_DRAFT, 9, 1}};
    static const int want[] = {3, 2, 1, 4};
    double started_unix_s = 0;
    struct store *store = ((struct store_fixture *)*state)->store;
    for (int i = 0; i < 6; i++) {
        struct job_row row = add(store, i + 1, "x", job[i].owner, 1);
        row.state = job[i].state;
        row.priority = job[i].priority;
        row.queued_unix_s = job[i].queued;
        assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
        if (job[i].state == JOB_RUNNING) started_unix_s = row.updated_unix_s;
    }
    for (size_t n_each = 1; n_each <= 3; n_each += 2) {
        struct queued_job *q = NULL;
        size_t n = 0;
        char id[STORE_ID_BYTES];
        assert_int_equal(store_job_queue(store, n_each, &q, &n, NULL), STATUS_OK);
        assert_int_equal(n, n_each == 1 ? 2 : 4);
        for (size_t i = 0; i < n; i++) {
            const int k = n_each == 1 && i == 1 ? 4 : want[i];
            make_id(k, id);
            assert_string_equal(q[i].id, id);
            assert_string_equal(q[i].owner, job[k - 1].owner);
            assert_true(q[i].batch[0] == '\0' && q[i].priority == job[k - 1].priority);
            assert_true(q[i].queued_unix_s == job[k - 1].queued);
            assert_true(q[i].last_start_unix_s == (k == 4 ? started_unix_s : 0));
        }
        free(q);
    }
}

static void read_verdict(void *context, const char *id, char code[40])
{
    (*(int *)context)++;
    snprintf(code, 40, "%s", id[7] == '1' ? "good" : "");
}

/* Verdicts of a database from before there were verdicts are read once. */
static void test_verdicts_are_filled_in(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row got;
    int n_read = 0;
    for (int i = 1; i <= 3; i++) {
        struct job_row row = add(store, i, "x", "", i);
        snprintf(row.verdict, sizeof row.verdict, "%s", i < 3 ? "?" : "usable");
        assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
    }
    for (int pass = 0; pass < 2; pass++) {
        assert_int_equal(store_fill_verdicts(store, read_verdict, &n_read, NULL), STATUS_OK);
        assert_int_equal(n_read, 2);
        for (int i = 1; i <= 3; i++) {
            char id[STORE_ID_BYTES];
            make_id(i, id);
            assert_int_equal(store_job_look(store, id, &got, NULL), STATUS_OK);
            assert_string_equal(got.verdict, i == 1 ? "good" : i == 2 ? "" : "usable");
        }
    }
}

static void test_tags_are_counted(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct tag_count *tag = NULL;
    size_t n = 0;
    fill(store);
    assert_int_equal(store_tag_count(store, NULL, &tag, &n, NULL), STATUS_OK);
    assert_int_equal(n, 3);
    assert_true(strcmp(tag[0].tag, "blue") == 0 && tag[0].n == 1 && strcmp(tag[1].tag, "red") == 0 && tag[1].n == 2);
    assert_true(strcmp(tag[2].tag, "redder") == 0 && tag[2].n == 1);
    free(tag);
    assert_int_equal(store_tag_count(store, "ann", &tag, &n, NULL), STATUS_OK);
    assert_true(n == 2 && tag[0].n == 1 && strcmp(tag[1].tag, "redder") == 0);
    free(tag);
    struct job_row row = add(store, 9, "many", "", 1);
    for (size_t i = 0; i < 70; i++)
        snprintf(row.tags + 4 * i, 5, " t%02d", (int)i); /* more than the first allocation */
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
    assert_int_equal(store_tag_count(store, "", &tag, &n, NULL), STATUS_OK);
    assert_int_equal(n, 70);
    for (size_t i = 0; i < n; i++) assert_true(tag[i].n == 1 && atoi(tag[i].tag + 1) == (int)i);
    free(tag);
}

static int run(const char *database)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_every_column, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_jobs_that_do_not_exist, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_keys, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_selections, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_orders_and_pages, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_many, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_the_queue, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_verdicts_are_filled_in, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_tags_are_counted, set_up, tear_down),
    };
    return cmocka_run_group_tests_name(database, tests, NULL, NULL);
}

int main(void) { return store_fixture_each(run); }
