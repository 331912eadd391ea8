/* Files of jobs, jobs that are brought back from their folders, and deliveries of webhooks in the database. With SQLite
 * and with PostgreSQL. */
#include "base/clock.h"
#include "server/store/store.h"
#include "server/store/store_delivery.h"
#include "tests/support/store/store_fixture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const char job_one[] = "11111111-0000-4000-8000-000000000000",
                  job_two[] = "22222222-0000-4000-8000-000000000000", batch[] = "bbbbbbbb-0000-4000-8000-000000000000";

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

static struct job_row job(const char *id, const char *owner)
{
    struct job_row row = {.state = JOB_DRAFT, .document = (char *)(uintptr_t) "{}", .created_unix_s = 10};
    snprintf(row.id, sizeof row.id, "%s", id);
    snprintf(row.owner, sizeof row.owner, "%s", owner);
    return row;
}

static struct job_row add_job(struct store *store, const char *id, const char *owner)
{
    struct job_row row = job(id, owner);
    assert_int_equal(store_job_insert(store, &row, NULL, NULL, NULL), STATUS_OK);
    return row;
}

static struct file_row file(const char *job_id, int n, int64_t size_bytes, const char *sha256, enum file_state state)
{
    struct file_row row = {.size_bytes = size_bytes, .offset_bytes = n, .state = state};
    snprintf(row.id, sizeof row.id, "%.8s-file-%d", job_id, n);
    snprintf(row.job_id, sizeof row.job_id, "%s", job_id);
    snprintf(row.name, sizeof row.name, "scan %d.tif", n);
    snprintf(row.role, sizeof row.role, "role %d", n);
    snprintf(row.sha256, sizeof row.sha256, "%s", sha256);
    for (size_t i = 0; i < sizeof row.hash_state; i++) row.hash_state[i] = (unsigned char)(i * 7 + (size_t)n);
    return row;
}

static void assert_same(const struct file_row *a, const struct file_row *b)
{
    assert_string_equal(a->id, b->id);
    assert_string_equal(a->job_id, b->job_id);
    assert_string_equal(a->name, b->name);
    assert_string_equal(a->role, b->role);
    assert_string_equal(a->sha256, b->sha256);
    assert_true(a->size_bytes == b->size_bytes && a->offset_bytes == b->offset_bytes && a->state == b->state);
    assert_memory_equal(a->hash_state, b->hash_state, sizeof a->hash_state);
}

static int64_t revision(struct store *store, const char *id)
{
    struct job_row row;
    assert_int_equal(store_job_look(store, id, &row, NULL), STATUS_OK);
    return row.revision;
}

static void test_files(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row one = add_job(store, job_one, "ann");
    struct file_row row[3] = {file(job_one, 1, 100, "aa", FILE_UPLOADING),
                              file(job_one, 2, 1LL << 40, "", FILE_COMPLETE),
                              file(job_one, 3, 300, "cc", FILE_VERIFIED)},
                    got, *list = NULL;
    size_t n = 0;
    int64_t count = 0, before = revision(store, job_one);
    assert_int_equal(store_file_insert(store, row, 3, &one, NULL), STATUS_OK);
    assert_true(revision(store, job_one) > before); /* who watches the job sees new files */
    for (int i = 0; i < 3; i++) {
        assert_int_equal(store_file_get(store, row[i].id, &got, NULL), STATUS_OK);
        assert_same(&got, &row[i]);
        assert_int_equal(got.stored_offset_bytes, row[i].offset_bytes);
        assert_int_equal(store_file_find(store, job_one, row[i].name, &got, NULL), STATUS_OK);
        assert_same(&got, &row[i]);
    }
    assert_int_equal(store_file_list(store, job_one, &list, &n, NULL), STATUS_OK);
    assert_int_equal(n, 3);
    for (size_t i = 0; i < n; i++) assert_same(&list[i], &row[i]);
    free(list);
    assert_int_equal(store_file_list(store, NULL, &list, &n, NULL), STATUS_OK); /* those that are not complete */
    assert_true(n == 2 && strcmp(list[0].id, row[0].id) == 0 && strcmp(list[1].id, row[2].id) == 0);
    free(list);
    assert_int_equal(store_file_count(store, job_one, &count, NULL), STATUS_OK);
    assert_int_equal(count, 3);
    before = revision(store, job_one);
    one.dirty = true;
    assert_int_equal(store_file_erase(store, row[1].id, &one, NULL), STATUS_OK);
    assert_true(revision(store, job_one) > before);
    struct job_row edited;
    assert_int_equal(store_job_look(store, job_one, &edited, NULL), STATUS_OK);
    assert_true(edited.dirty);
    assert_int_equal(store_file_erase(store, row[2].id, NULL, NULL), STATUS_OK);
    assert_int_equal(store_file_count(store, job_one, &count, NULL), STATUS_OK);
    assert_int_equal(count, 1);
    assert_int_equal(store_file_get(store, row[1].id, &got, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_file_find(store, job_two, row[0].name, &got, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_job_erase(store, job_one, NULL), STATUS_OK);
    assert_int_equal(store_file_get(store, row[0].id, &got, NULL), STATUS_NOT_FOUND);
}

/* A list of more files than its first allocation has room for. */
static void test_many_files(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct file_row row[150], *list = NULL;
    size_t n = 0;
    add_job(store, job_one, "");
    for (int i = 0; i < 150; i++) row[i] = file(job_one, i, 1000, "", FILE_UPLOADING);
    assert_int_equal(store_file_insert(store, row, 150, NULL, NULL), STATUS_OK);
    assert_int_equal(store_file_list(store, job_one, &list, &n, NULL), STATUS_OK);
    assert_int_equal(n, 150);
    for (size_t i = 0; i < n; i++) assert_same(&list[i], &row[i]);
    free(list);
}

/* A writer that another one has overtaken changes nothing. */
static void test_updates(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct error err = {0};
    struct file_row row = file(job_one, 1, 100, "", FILE_UPLOADING), first, second;
    add_job(store, job_one, "");
    assert_int_equal(store_file_insert(store, &row, 1, NULL, NULL), STATUS_OK);
    assert_int_equal(store_file_get(store, row.id, &first, NULL), STATUS_OK);
    second = first;
    for (int64_t offset = 50; offset <= 100; offset += 50) { /* its own offset follows */
        first.offset_bytes = offset;
        first.state = offset == 100 ? FILE_COMPLETE : FILE_UPLOADING;
        first.hash_state[3] ^= 0xff;
        snprintf(first.sha256, sizeof first.sha256, "%lld", (long long)offset);
        assert_int_equal(store_file_update(store, &first, NULL), STATUS_OK);
        assert_int_equal(store_file_get(store, row.id, &row, NULL), STATUS_OK);
        assert_same(&row, &first);
    }
    second.offset_bytes = 70;
    assert_int_equal(store_file_update(store, &second, &err), STATUS_STALE);
    assert_non_null(strstr(err.text, "taken over the upload of 'scan 1.tif'"));
    assert_int_equal(store_file_get(store, row.id, &row, NULL), STATUS_OK);
    assert_same(&row, &first);
    snprintf(second.id, sizeof second.id, "none");
    assert_int_equal(store_file_update(store, &second, &err), STATUS_NOT_FOUND);
}

/* Bytes that an owner has: whole ones only, of jobs that are not deleted, and of no other owner. */
static void test_known_bytes(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row one = add_job(store, job_one, "ann"), two = add_job(store, job_two, "ann");
    const struct file_row row[] = {
        file(job_one, 1, 100, "aa", FILE_COMPLETE), file(job_two, 2, 100, "aa", FILE_COMPLETE),
        file(job_two, 3, 100, "bb", FILE_VERIFIED), file(job_two, 4, 100, "", FILE_COMPLETE)};
    struct file_row got;
    for (size_t i = 0; i < 4; i++) assert_int_equal(store_file_insert(store, &row[i], 1, NULL, NULL), STATUS_OK);
    for (int64_t size = -1; size <= 100; size += 101) {
        assert_int_equal(store_file_known(store, "ann", "aa", size, &got, NULL), STATUS_OK);
        assert_same(&got, &row[1]); /* the newest */
        assert_int_equal(store_file_known(store, "bob", "aa", size, &got, NULL), STATUS_NOT_FOUND);
        assert_int_equal(store_file_known(store, "ann", "bb", size, &got, NULL), STATUS_NOT_FOUND);
        assert_int_equal(store_file_known(store, "ann", "", size, &got, NULL), STATUS_NOT_FOUND);
    }
    assert_int_equal(store_file_known(store, "ann", "aa", 99, &got, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_file_known(store, "ann", "aa", 0, &got, NULL), STATUS_NOT_FOUND);
    two.deleted = true;
    assert_int_equal(store_job_update(store, &two, NULL), STATUS_OK);
    assert_int_equal(store_file_known(store, "ann", "aa", 100, &got, NULL), STATUS_OK);
    assert_same(&got, &row[0]);
    (void)one;
}

/* A job of a folder: new to the database, and known to it. */
static void test_import(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct job_row row = job(job_one, "ann"), got;
    struct file_row f[2] = {file(job_one, 1, 100, "aa", FILE_COMPLETE), file(job_one, 2, 200, "", FILE_UPLOADING)};
    char id[STORE_ID_BYTES], hash[STORE_HASH_TEXT_BYTES];
    int64_t n = 0;
    row.state = JOB_SUCCEEDED;
    row.attempt = 4;
    row.updated_unix_s = 77;
    row.finished_unix_s = 66;
    const double now = clock_wall_s();
    assert_int_equal(store_import(store, &row, f, 2, "key", "hash", NULL), STATUS_OK);
    assert_true(row.serial > 0 && row.updated_unix_s == 77 && row.state == JOB_SUCCEEDED);
    assert_int_equal(store_job_get(store, job_one, &got, NULL), STATUS_OK);
    assert_true(got.state == JOB_SUCCEEDED && got.attempt == 4 && got.updated_unix_s == 77 && got.created_unix_s == 10);
    assert_true(got.finished_unix_s == 66 && (double)got.revision >= now - 1); /* over all that clients have seen */
    assert_string_equal(got.document, "{}");
    job_row_release(&got);
    assert_int_equal(store_idempotency_find(store, "ann", "key", id, hash, NULL), STATUS_OK);
    assert_string_equal(hash, "hash");
    row.document = (char *)(uintptr_t) "{\"again\":1}";
    row.state = JOB_DRAFT;
    const int64_t serial = row.serial, before = revision(store, job_one);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(store_import(store, &row, &f[1], 1, i == 0 ? NULL : "second", "hash 2", NULL), STATUS_OK);
        assert_int_equal(store_job_get(store, job_one, &got, NULL), STATUS_OK);
        assert_true(got.state == JOB_DRAFT && got.serial == serial && got.revision > before);
        assert_string_equal(got.document, "{\"again\":1}");
        job_row_release(&got);
        assert_int_equal(store_file_count(store, job_one, &n, NULL), STATUS_OK);
        assert_int_equal(n, 1);
        assert_int_equal(store_idempotency_find(store, "ann", "second", id, hash, NULL),
                         i == 0 ? STATUS_NOT_FOUND : STATUS_OK);
    }
}

/* A job without a batch, of a batch that is not there, of one that is, of another owner's, and of a broken id. */
static void test_import_of_batches(void **state)
{
    static const struct {
        const char *job, *owner, *batch, *name, *want_name;
    } check[] = {{"11111111-0000-4000-8000-000000000001", "ann", "", "", ""},
                 {"11111111-0000-4000-8000-000000000002", "ann", batch, "night", "night"},
                 {"11111111-0000-4000-8000-000000000003", "ann", batch, "other", "night"},
                 {"11111111-0000-4000-8000-000000000004", "bob", batch, "night", ""},
                 {"11111111-0000-4000-8000-000000000005", "ann", "short", "night", ""},
                 {"11111111-0000-4000-8000-000000000006", "ann", "cccccccc-0000-4000-8000-000000000000", "night",
                  "night cccccccc"}};
    struct store *store = ((struct store_fixture *)*state)->store;
    for (size_t i = 0; i < sizeof check / sizeof *check; i++) {
        struct job_row row = job(check[i].job, check[i].owner), got;
        snprintf(row.batch, sizeof row.batch, "%s", check[i].batch);
        snprintf(row.batch_name, sizeof row.batch_name, "%s", check[i].name);
        row.batch_place = 3;
        assert_int_equal(store_import(store, &row, NULL, 0, NULL, NULL, NULL), STATUS_OK);
        assert_int_equal(store_job_look(store, row.id, &got, NULL), STATUS_OK);
        assert_string_equal(got.batch, check[i].want_name[0] != '\0' ? check[i].batch : "");
        assert_string_equal(got.batch_name, check[i].want_name);
        assert_int_equal(got.batch_place, 3);
    }
}

static void end_job(struct store *store, const char *id, enum job_state how, int64_t attempt)
{
    struct job_row row;
    assert_int_equal(store_job_look(store, id, &row, NULL), STATUS_OK);
    row.state = JOB_RUNNING;
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
    row.state = how;
    row.attempt = attempt;
    snprintf(row.sample, sizeof row.sample, "sample %d", (int)attempt);
    snprintf(row.error_code, sizeof row.error_code, "code");
    snprintf(row.error_field, sizeof row.error_field, "field");
    snprintf(row.error_text, sizeof row.error_text, "text");
    snprintf(row.verdict, sizeof row.verdict, "good");
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
}

/* Deliveries 2 to 4 of the test below. */
static void check_selections(struct store *store, int64_t newest)
{
    struct delivery_row *list = NULL;
    size_t n = 0;
    const struct {
        const char *owner, *job_id;
        int64_t before;
        size_t limit, n;
        int64_t first;
    } check[] = {{NULL, NULL, newest, 10, 2, 3}, {NULL, NULL, 0, 1, 1, 4},      {"ann", NULL, 0, 10, 2, 4},
                 {NULL, job_two, 0, 10, 1, 3},   {"ann", job_two, 0, 10, 0, 0}, {"ann", job_one, newest, 10, 1, 2},
                 {"bob", NULL, 0, 10, 1, 3}};
    for (size_t i = 0; i < sizeof check / sizeof *check; i++) {
        assert_int_equal(store_delivery_list(store, check[i].owner, check[i].job_id, check[i].before, check[i].limit,
                                             &list, &n, NULL),
                         STATUS_OK);
        if (n != check[i].n || (n > 0 && list[0].attempt != check[i].first)) fail_msg("list %zu: %zu", i, n);
        free(list);
    }
}

static void test_deliveries(void **state)
{
    struct store *store = ((struct store_fixture *)*state)->store;
    struct delivery_row d, *list = NULL;
    size_t n = 0;
    add_job(store, job_one, "ann");
    add_job(store, job_two, "bob");
    end_job(store, job_one, JOB_SUCCEEDED, 1);
    assert_int_equal(store_delivery_next(store, &d, NULL), STATUS_NOT_FOUND); /* there is no webhook */
    for (int i = 0; i < 2; i++) assert_int_equal(store_webhook_enable(store, true, NULL), STATUS_OK);
    end_job(store, job_one, JOB_FAILED, 2);
    end_job(store, job_two, JOB_CANCELLED, 3);
    end_job(store, job_one, JOB_SUCCEEDED, 4);
    assert_int_equal(store_delivery_next(store, &d, NULL), STATUS_OK);
    assert_true(d.state == DELIVERY_WAITING && d.job_state == JOB_FAILED && d.attempt == 2 && d.n_try == 0);
    assert_true(strcmp(d.job_id, job_one) == 0 && strcmp(d.sample, "sample 2") == 0 && d.created_unix_s > 0);
    assert_true(strcmp(d.error_code, "code") == 0 && strcmp(d.error_field, "field") == 0 && d.id[0] != '\0');
    assert_string_equal(d.error_text, "text");
    assert_string_equal(d.verdict, ""); /* a verdict of the run before, which this failed run has nothing to do with */
    d.n_try = 3;
    d.next_unix_s = 4e9; /* the others come first */
    d.http_status = 503;
    snprintf(d.error, sizeof d.error, "busy");
    assert_int_equal(store_delivery_update(store, &d, NULL), STATUS_OK);
    struct delivery_row next;
    assert_int_equal(store_delivery_next(store, &next, NULL), STATUS_OK);
    assert_true(next.attempt == 3 && next.http_status == 0);
    next.state = DELIVERY_DELIVERED;
    next.delivered_unix_s = 55;
    assert_int_equal(store_delivery_update(store, &next, NULL), STATUS_OK);
    assert_int_equal(store_delivery_list(store, NULL, NULL, 0, 10, &list, &n, NULL), STATUS_OK);
    assert_true(n == 3 && list[0].attempt == 4 && list[1].attempt == 3 && list[2].attempt == 2);
    assert_true(list[1].state == DELIVERY_DELIVERED && list[1].delivered_unix_s == 55 && list[2].http_status == 503);
    assert_true(list[2].n_try == 3 && list[2].next_unix_s == 4e9 && strcmp(list[2].error, "busy") == 0);
    assert_string_equal(list[0].verdict, "good");
    const int64_t newest = list[0].serial;
    free(list);
    check_selections(store, newest);
    assert_int_equal(store_delivery_prune(store, 1, NULL), STATUS_OK); /* only the delivered one may go */
    assert_int_equal(store_delivery_list(store, NULL, NULL, 0, 10, &list, &n, NULL), STATUS_OK);
    assert_true(n == 2 && list[0].attempt == 4 && list[1].attempt == 2);
    free(list);
    assert_int_equal(store_webhook_enable(store, false, NULL), STATUS_OK);
    assert_int_equal(store_delivery_next(store, &d, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_delivery_list(store, NULL, NULL, 0, 10, &list, &n, NULL), STATUS_OK);
    assert_true(n == 2 && list[0].state == DELIVERY_FAILED && strstr(list[0].error, "switched off") != NULL);
    free(list);
    end_job(store, job_two, JOB_FAILED, 9);
    assert_int_equal(store_delivery_next(store, &d, NULL), STATUS_NOT_FOUND);
}

static int run(const char *database)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_files, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_many_files, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_updates, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_known_bytes, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_import, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_import_of_batches, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_deliveries, set_up, tear_down),
    };
    return cmocka_run_group_tests_name(database, tests, NULL, NULL);
}

int main(void) { return store_fixture_each(run); }
