/* Tokens in the store, what they grant, how their requests are counted, and what owners keep. */
#include "server/access/access_registry.h"
#include "server/access/access_secret.h"
#include "tests/support/store/store_fixture.h"

#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

struct fixture {
    struct store_fixture db;
    struct settings settings;
    struct store *store;
    struct access_registry *registry;
};

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    if (f == NULL || store_fixture_begin(&f->db) != 0) return 1;
    f->store = f->db.store;
    settings_init(&f->settings);
    *state = f;
    return access_registry_new(f->store, &f->settings, &f->registry, NULL) != STATUS_OK;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    access_registry_free(f->registry);
    store_fixture_end(&f->db);
    free(f);
    return 0;
}

static void make(struct fixture *f, const char *name, int64_t per_minute, char text[ACCESS_SECRET_TEXT_BYTES])
{
    struct token_row row = {.scope = ACCESS_SUBMIT, .quota = {per_minute, QUOTA_DEFAULT, 0}};
    snprintf(row.name, sizeof row.name, "%s", name);
    assert_int_equal(access_token_make(f->store, &row, text, NULL), STATUS_OK);
}

static void test_tokens_are_needed_from_the_first_one_on(void **state)
{
    struct fixture *f = *state;
    struct access_grant grant;
    struct token_row row;
    char text[ACCESS_SECRET_TEXT_BYTES], other[ACCESS_SECRET_TEXT_BYTES];
    bool required = true;
    assert_int_equal(access_required(f->registry, &required, NULL), STATUS_OK);
    assert_false(required);
    assert_int_equal(access_find(f->registry, "x", false, &grant, NULL), STATUS_NOT_FOUND);
    make(f, "ann", QUOTA_DEFAULT, text);
    make(f, "bob", QUOTA_DEFAULT, other);
    assert_string_not_equal(text, other);
    assert_int_equal(access_required(f->registry, &required, NULL), STATUS_OK);
    assert_true(required);
    f->settings.stored_bytes = 77;
    assert_int_equal(access_find(f->registry, text, false, &grant, NULL), STATUS_OK);
    assert_string_equal(grant.owner, "ann");
    assert_int_equal(grant.scope, ACCESS_SUBMIT);
    assert_false(grant.all);
    assert_int_equal(grant.quota.stored_bytes, 77);                                         /* of the settings */
    assert_int_equal(grant.quota.jobs, 0);                                                  /* its own: no limit */
    assert_int_equal(access_find(f->registry, text, true, &grant, NULL), STATUS_NOT_FOUND); /* a token is no session */
    assert_int_equal(store_token_get(f->store, "ann", &row, NULL), STATUS_OK);
    assert_int_equal(store_token_revoke(f->store, row.id, 1, NULL), STATUS_OK);
    assert_int_equal(access_find(f->registry, text, false, &grant, NULL), STATUS_NOT_FOUND);
    assert_int_equal(store_token_get(f->store, "bob", &row, NULL), STATUS_OK);
    assert_int_equal(store_token_revoke(f->store, row.id, 1, NULL), STATUS_OK);
    assert_int_equal(access_required(f->registry, &required, NULL), STATUS_OK);
    assert_true(required);
}

static void test_the_configuration_can_ask_for_tokens_always(void **state)
{
    struct fixture *f = *state;
    bool required = false;
    assert_int_equal(settings_set(&f->settings, "access.required", "never", NULL), STATUS_INVALID);
    assert_int_equal(settings_set(&f->settings, "access.required", "always", NULL), STATUS_OK);
    assert_int_equal(access_required(f->registry, &required, NULL), STATUS_OK);
    assert_true(required);
}

static void test_requests_of_a_minute(void **state)
{
    struct fixture *f = *state;
    struct access_grant ann, bob;
    char text[ACCESS_SECRET_TEXT_BYTES];
    make(f, "ann", 6, text);
    assert_int_equal(access_find(f->registry, text, false, &ann, NULL), STATUS_OK);
    make(f, "bob", 0, text);
    assert_int_equal(access_find(f->registry, text, false, &bob, NULL), STATUS_OK);
    for (int i = 0; i < 6; i++) assert_int_equal(access_count(f->registry, &ann, 1000), 0);
    assert_int_equal(access_count(f->registry, &ann, 1000), 10); /* one each 10 s */
    assert_int_equal(access_count(f->registry, &ann, 1004), 6);  /* a refused one costs nothing */
    assert_int_equal(access_count(f->registry, &ann, 1010.5), 0);
    assert_int_equal(access_count(f->registry, &ann, 1010.6), 10);
    for (int i = 0; i < 6; i++)
        assert_int_equal(access_count(f->registry, &ann, 5000), 0); /* never more than a minute's */
    assert_true(access_count(f->registry, &ann, 5000) > 0);
    for (int i = 0; i < 1000; i++) assert_int_equal(access_count(f->registry, &bob, 1000), 0);
    struct access_grant everyone = access_grant_of_everyone();
    assert_int_equal(access_count(f->registry, &everyone, 1000), 0);
}

static void test_last_uses_reach_the_database(void **state)
{
    struct fixture *f = *state;
    struct access_grant ann;
    struct token_row row;
    char text[ACCESS_SECRET_TEXT_BYTES];
    make(f, "ann", 0, text);
    assert_int_equal(access_find(f->registry, text, false, &ann, NULL), STATUS_OK);
    access_count(f->registry, &ann, 1000);
    access_registry_flush(f->registry, false); /* not due yet */
    assert_int_equal(store_token_get(f->store, "ann", &row, NULL), STATUS_OK);
    assert_true(row.used_unix_s == 0);
    access_registry_flush(f->registry, true);
    assert_int_equal(store_token_get(f->store, "ann", &row, NULL), STATUS_OK);
    assert_true(row.used_unix_s > 0);
}

enum { N_THREAD = 8, N_ROUND = 400 };
struct racer {
    struct fixture *f;
    const char *text;
    int n_allowed, n_refused, n_unknown;
};

static void *race(void *context)
{
    struct racer *r = context;
    struct access_grant grant;
    for (int i = 0; i < N_ROUND; i++) {
        if (access_find(r->f->registry, r->text, false, &grant, NULL) != STATUS_OK)
            r->n_unknown++;
        else if (access_count(r->f->registry, &grant, 1000) == 0)
            r->n_allowed++;
        else
            r->n_refused++;
        if (i % 100 == 0) access_registry_flush(r->f->registry, true);
    }
    return NULL;
}

/* A quota holds for all threads together. */
static void test_threads_share_a_quota(void **state)
{
    struct fixture *f = *state;
    struct racer racer[N_THREAD];
    pthread_t thread[N_THREAD];
    struct token_row row;
    char text[ACCESS_SECRET_TEXT_BYTES];
    int n_allowed = 0;
    make(f, "ann", 500, text);
    for (int i = 0; i < N_THREAD; i++) {
        racer[i] = (struct racer){.f = f, .text = text};
        assert_int_equal(pthread_create(&thread[i], NULL, race, &racer[i]), 0);
    }
    for (int i = 0; i < N_THREAD; i++) {
        pthread_join(thread[i], NULL);
        n_allowed += racer[i].n_allowed;
        assert_int_equal(racer[i].n_unknown, 0);
    }
    assert_int_equal(n_allowed, 500);
    assert_int_equal(store_token_get(f->store, "ann", &row, NULL), STATUS_OK);
    assert_int_equal(store_token_revoke(f->store, row.id, 1, NULL), STATUS_OK);
    racer[0] = (struct racer){.f = f, .text = text};
    race(&racer[0]);
    assert_int_equal(racer[0].n_unknown, N_ROUND);
}

static void insert_job(struct fixture *f, const char *id, const char *owner, enum job_state state, int64_t priority)
{
    struct job_row row = {.state = JOB_DRAFT, .document = (char *)(uintptr_t) "{}"};
    snprintf(row.id, sizeof row.id, "%s", id);
    snprintf(row.owner, sizeof row.owner, "%s", owner);
    assert_int_equal(store_job_insert(f->store, &row, NULL, NULL, NULL), STATUS_OK);
    row.state = state;
    row.priority = priority;
    row.queued_unix_s = (double)row.serial;
    assert_int_equal(store_job_update(f->store, &row, NULL), STATUS_OK);
}

static void expect_heads(struct fixture *f, size_t n_each, const char *ids)
{
    struct queued_job *job = NULL;
    size_t n = 0;
    char text[64] = "";
    assert_int_equal(store_job_queue(f->store, n_each, &job, &n, NULL), STATUS_OK);
    for (size_t i = 0; i < n; i++) strncat(text, job[i].id, sizeof text - strlen(text) - 1);
    free(job);
    assert_string_equal(text, ids);
}

static void test_the_heads_of_all_queues(void **state)
{
    struct fixture *f = *state;
    expect_heads(f, 9, "");
    insert_job(f, "a", "ann", JOB_QUEUED, 0);
    insert_job(f, "b", "ann", JOB_QUEUED, 0);
    insert_job(f, "c", "ann", JOB_QUEUED, 3);
    insert_job(f, "d", "bob", JOB_QUEUED, -10);
    insert_job(f, "e", "cid", JOB_RUNNING, 0);
    insert_job(f, "f", "", JOB_QUEUED, 0);
    expect_heads(f, 1, "fcd");
    expect_heads(f, 2, "fcad");
    struct job_row row;
    assert_int_equal(store_job_look(f->store, "c", &row, NULL), STATUS_OK);
    row.state = JOB_RUNNING;
    assert_int_equal(store_job_update(f->store, &row, NULL), STATUS_OK);
    assert_int_equal(store_job_look(f->store, "d", &row, NULL), STATUS_OK);
    row.deleted = true;
    assert_int_equal(store_job_update(f->store, &row, NULL), STATUS_OK);
    expect_heads(f, 9, "fab");
}

static void expect_use(struct fixture *f, const char *owner, int64_t jobs, int64_t bytes)
{
    struct owner_use use = {-1, -1};
    assert_int_equal(store_owner_use(f->store, owner, &use, NULL), STATUS_OK);
    assert_int_equal(use.jobs, jobs);
    assert_int_equal(use.bytes, bytes);
}

static void test_what_an_owner_keeps(void **state)
{
    struct fixture *f = *state;
    struct job_row row;
    struct file_row file[2] = {{.id = "u", .job_id = "a", .name = "x", .size_bytes = 5},
                               {.id = "v", .job_id = "a", .name = "y", .size_bytes = 7}};
    insert_job(f, "a", "ann", JOB_DRAFT, 0);
    insert_job(f, "b", "bob", JOB_DRAFT, 0);
    assert_int_equal(store_file_insert(f->store, file, 2, NULL, NULL), STATUS_OK);
    expect_use(f, "ann", 1, 12);
    expect_use(f, "bob", 1, 0);
    expect_use(f, "cid", 0, 0);
    assert_int_equal(store_file_erase(f->store, "u", NULL, NULL), STATUS_OK);
    expect_use(f, "ann", 1, 7);
    assert_int_equal(store_job_look(f->store, "a", &row, NULL), STATUS_OK);
    row.deleted = true;
    assert_int_equal(store_job_update(f->store, &row, NULL), STATUS_OK);
    expect_use(f, "ann", 0, 0);
    assert_int_equal(store_job_erase(f->store, "a", NULL),
                     STATUS_OK); /* its file goes, too, and is not counted twice */
    expect_use(f, "ann", 0, 0);
    assert_int_equal(store_job_erase(f->store, "b", NULL), STATUS_OK); /* without having been a tombstone */
    expect_use(f, "bob", 0, 0);
}

static int run(const char *database)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_tokens_are_needed_from_the_first_one_on, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_the_configuration_can_ask_for_tokens_always, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_requests_of_a_minute, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_last_uses_reach_the_database, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_threads_share_a_quota, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_the_heads_of_all_queues, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_what_an_owner_keeps, set_up, tear_down),
    };
    return cmocka_run_group_tests_name(database, tests, NULL, NULL);
}

int main(void) { return store_fixture_each(run); }
