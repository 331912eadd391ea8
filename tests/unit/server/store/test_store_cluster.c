/* Two daemons on one database: who has a job, a duty or the gate, and what becomes of it when a daemon ends. */
#include "server/store/store_cluster.h"
#include "server/store/store_rows.h"
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

enum { LEASE_S = 60 };

/* Two stores of one database, as two daemons have them. */
struct fixture {
    struct store_fixture db;
    struct store *one, *two;
};

static int set_up(void **state)
{
    struct fixture *f = calloc(1, sizeof *f);
    if (f == NULL || store_fixture_begin(&f->db) != 0) return 1;
    *state = f;
    f->one = f->db.store;
    return store_open_place(&f->db.place, &f->two, NULL) != STATUS_OK ||
           store_daemon_begin(f->one, "here", 1, LEASE_S, NULL) != STATUS_OK ||
           store_daemon_begin(f->two, "there", 2, LEASE_S, NULL) != STATUS_OK;
}

static int tear_down(void **state)
{
    struct fixture *f = *state;
    store_close(f->two);
    store_fixture_end(&f->db);
    free(f);
    return 0;
}

static void add_job(struct store *store, const char *id, enum job_state state)
{
    struct job_row row = {.state = JOB_DRAFT, .document = (char *)(uintptr_t) "{}"};
    snprintf(row.id, sizeof row.id, "%s", id);
    assert_int_equal(store_job_insert(store, &row, NULL, NULL, NULL), STATUS_OK);
    row.state = state;
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
}

static void set_state(struct store *store, const char *id, enum job_state state)
{
    struct job_row row;
    assert_int_equal(store_job_look(store, id, &row, NULL), STATUS_OK);
    row.state = state;
    assert_int_equal(store_job_update(store, &row, NULL), STATUS_OK);
}

/* ---- claims */

struct racer {
    struct store *store;
    pthread_barrier_t *begin;
    int n_got;
};

static void *race(void *context)
{
    struct racer *r = context;
    char id[STORE_ID_BYTES];
    pthread_barrier_wait(r->begin);
    for (int i = 0; i < 40; i++) {
        snprintf(id, sizeof id, "job-%d", i);
        r->n_got += store_job_claim(r->store, id, NULL) == STATUS_OK;
    }
    return NULL;
}

static void test_a_job_is_claimed_by_one(void **state)
{
    struct fixture *f = *state;
    pthread_barrier_t begin;
    pthread_t thread[2];
    char id[STORE_ID_BYTES];
    struct racer racer[2] = {{f->one, &begin, 0}, {f->two, &begin, 0}};
    for (int i = 0; i < 40; i++) {
        snprintf(id, sizeof id, "job-%d", i);
        add_job(f->one, id, JOB_QUEUED);
    }
    pthread_barrier_init(&begin, NULL, 2);
    for (int i = 0; i < 2; i++) assert_int_equal(pthread_create(&thread[i], NULL, race, &racer[i]), 0);
    for (int i = 0; i < 2; i++) pthread_join(thread[i], NULL);
    pthread_barrier_destroy(&begin);
    assert_int_equal(racer[0].n_got + racer[1].n_got, 40);
}

static void test_what_a_daemon_held_can_be_had_when_it_has_ended(void **state)
{
    struct fixture *f = *state;
    char(*id)[STORE_ID_BYTES] = NULL;
    size_t n = 0;
    bool elsewhere = false, held = false;
    add_job(f->one, "queued", JOB_QUEUED);
    add_job(f->one, "running", JOB_QUEUED);
    assert_int_equal(store_job_claim(f->one, "queued", NULL), STATUS_OK);
    assert_int_equal(store_job_claim(f->one, "running", NULL), STATUS_OK);
    set_state(f->one, "running", JOB_RUNNING);
    assert_int_equal(store_job_claim(f->two, "queued", NULL), STATUS_CONFLICT);
    assert_int_equal(store_job_take(f->two, "running", NULL), STATUS_CONFLICT);
    assert_int_equal(store_job_elsewhere(f->two, "running", &elsewhere, NULL), STATUS_OK);
    assert_true(elsewhere);
    assert_true(store_duty_is_mine(f->one, "removal"));
    assert_false(store_duty_is_mine(f->two, "removal"));
    assert_int_equal(store_job_orphans(f->two, &id, &n, NULL), STATUS_OK);
    assert_int_equal(n, 0);
    assert_int_equal(store_daemon_end(f->one, NULL), STATUS_OK);
    assert_int_equal(store_job_orphans(f->two, &id, &n, NULL), STATUS_OK);
    assert_int_equal(n, 1);
    assert_string_equal(id[0], "running");
    free(id);
    assert_int_equal(store_job_take(f->two, "running", NULL), STATUS_OK);
    assert_int_equal(store_job_claim(f->two, "queued", NULL), STATUS_OK);
    assert_true(store_duty_is_mine(f->two, "removal"));
    /* the daemon that has lost its lease learns of it, and gets nothing more */
    assert_int_equal(store_daemon_renew(f->one, LEASE_S, &held, NULL), STATUS_OK);
    assert_false(held);
    add_job(f->two, "new", JOB_QUEUED);
    assert_int_equal(store_job_claim(f->one, "new", NULL), STATUS_CONFLICT);
    assert_false(store_duty_is_mine(f->one, "removal"));
}

static void test_many_jobs_without_a_daemon(void **state)
{
    enum { MANY = 200 };
    struct fixture *f = *state;
    char id[STORE_ID_BYTES], (*found)[STORE_ID_BYTES] = NULL;
    size_t n = 0;
    for (int i = 0; i < MANY; i++) {
        snprintf(id, sizeof id, "a job of a long name, number %d", i);
        add_job(f->one, id, JOB_RUNNING);
    }
    assert_int_equal(store_job_orphans(f->two, &found, &n, NULL), STATUS_OK);
    assert_int_equal(n, MANY);
    for (size_t i = 0; i < n; i++) assert_memory_equal(found[i], "a job of a long name", 20);
    free(found);
}

static void test_a_claim_ends_with_the_state_that_it_was_for(void **state)
{
    struct fixture *f = *state;
    add_job(f->one, "a", JOB_QUEUED);
    assert_int_equal(store_job_claim(f->one, "a", NULL), STATUS_OK);
    assert_int_equal(store_job_unclaim(f->one, "a", NULL), STATUS_OK);
    assert_int_equal(store_job_claim(f->two, "a", NULL), STATUS_OK);
    set_state(f->two, "a", JOB_RUNNING);
    set_state(f->two, "a", JOB_QUEUED); /* a lost attempt */
    assert_int_equal(store_job_claim(f->one, "a", NULL), STATUS_OK);
}

/* ---- leases */

static void test_a_lease_that_has_ended_is_removed_with_its_connections(void **state)
{
    struct fixture *f = *state;
    int n = 0;
    bool held = true;
    struct error err = {0};
    assert_int_equal(store_daemon_renew(f->one, -1, &held, NULL), STATUS_OK); /* it ended a second ago */
    store_gate_enter(f->one, "a", NULL);
    assert_int_equal(store_daemons_remove(f->two, 0, &n, NULL), STATUS_OK);
    assert_int_equal(n, 1);
    usleep(200000);
    /* the gate is open to others, and shut to who held it */
    assert_int_equal(store_probe(f->one, &err), STATUS_IO);
    store_gate_leave(f->one);
    store_gate_enter(f->two, "a", NULL);
    assert_int_equal(store_probe(f->two, NULL), STATUS_OK);
    store_gate_leave(f->two);
    /* a new lease, over connections that are opened again */
    assert_int_equal(store_daemon_begin(f->one, "here", 1, LEASE_S, &err), STATUS_OK);
    assert_int_equal(store_probe(f->one, NULL), STATUS_OK);
    assert_int_equal(store_daemons_remove(f->two, 0, &n, NULL), STATUS_OK);
    assert_int_equal(n, 0);
}

/* ---- the gate */

struct visitor {
    struct store *store;
    const char *job;
    atomic_bool inside;
};

static void *visit(void *context)
{
    struct visitor *v = context;
    store_gate_enter(v->store, v->job, NULL);
    atomic_store(&v->inside, true);
    store_gate_leave(v->store);
    return NULL;
}

static void test_the_gate_admits_one_for_a_job(void **state)
{
    struct fixture *f = *state;
    static const char *const job[3] = {"a", "b", NULL};
    static const bool waits[3] = {true, false, true};
    for (int i = 0; i < 3; i++) {
        struct visitor v = {.store = f->two, .job = job[i]};
        pthread_t thread;
        store_gate_enter(f->one, "a", NULL);
        assert_int_equal(pthread_create(&thread, NULL, visit, &v), 0);
        usleep(200000);
        assert_int_equal(atomic_load(&v.inside), !waits[i]);
        store_gate_leave(f->one);
        pthread_join(thread, NULL);
        assert_true(atomic_load(&v.inside));
    }
}

/* ---- changes */

static void test_a_change_whose_connection_is_lost_is_an_error_and_not_made(void **state)
{
    struct fixture *f = *state;
    struct job_row row;
    struct error err = {0};
    add_job(f->one, "a", JOB_DRAFT);
    pthread_mutex_lock(&f->one->write.lock);
    assert_int_equal(store_begin(&f->one->write, &err), STATUS_OK);
    status s = store_run(&f->one->write, NULL, &err, "UPDATE job SET state = 1 WHERE id = ?", "s", "a");
    assert_int_equal(s, STATUS_OK);
    assert_int_equal(store_run(&f->two->write, NULL, NULL,
                               "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = ?", "s",
                               f->one->write.application),
                     STATUS_OK);
    usleep(200000);
    assert_int_equal(store_end(&f->one->write, s, &err), STATUS_IO);
    pthread_mutex_unlock(&f->one->write.lock);
    /* both connections are opened again by what needs them */
    assert_int_equal(store_job_look(f->one, "a", &row, NULL), STATUS_OK);
    assert_int_equal(row.state, JOB_DRAFT);
    set_state(f->one, "a", JOB_QUEUED);
}

static void test_an_upload_goes_on_at_one_daemon(void **state)
{
    struct fixture *f = *state;
    struct file_row row = {.id = "f", .job_id = "a", .name = "scan.tif", .size_bytes = 10}, here, there;
    add_job(f->one, "a", JOB_DRAFT);
    assert_int_equal(store_file_insert(f->one, &row, 1, NULL, NULL), STATUS_OK);
    assert_int_equal(store_file_get(f->one, "f", &here, NULL), STATUS_OK);
    assert_int_equal(store_file_get(f->two, "f", &there, NULL), STATUS_OK);
    there.offset_bytes = 5;
    assert_int_equal(store_file_update(f->two, &there, NULL), STATUS_OK);
    here.offset_bytes = 3;
    assert_int_equal(store_file_update(f->one, &here, NULL), STATUS_STALE);
    there.offset_bytes = 10;
    assert_int_equal(store_file_update(f->two, &there, NULL), STATUS_OK);
    assert_int_equal(store_file_get(f->one, "f", &here, NULL), STATUS_OK);
    assert_int_equal(here.offset_bytes, 10);
}

static void count_change(void *context, const char *job_id)
{
    if (strcmp(job_id, "a") == 0) ++*(int *)context;
}

static void test_changes_at_one_daemon_are_told_to_others(void **state)
{
    struct fixture *f = *state;
    int n = 0;
    store_on_change(f->two, count_change, &n);
    add_job(f->one, "a", JOB_DRAFT);
    usleep(100000);
    store_read_changes(f->two);
    assert_true(n > 0);
}

static void count_unknown(void *context, const char *job_id)
{
    if (job_id == NULL) ++*(int *)context;
}

static void test_a_connection_that_was_lost_may_have_missed_changes(void **state)
{
    struct fixture *f = *state;
    int n = 0;
    store_on_change(f->two, count_unknown, &n);
    store_read_changes(f->two);
    assert_int_equal(n, 0);
    assert_int_equal(store_run(&f->one->write, NULL, NULL,
                               "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE application_name = ?", "s",
                               f->two->read.application),
                     STATUS_OK);
    usleep(200000);
    store_read_changes(f->two);
    store_read_changes(f->two);
    assert_int_equal(n, 1);
}

static void test_a_password_in_a_malformed_address_is_not_quoted(void **state)
{
    static const char *const address[] = {"postgresql://u:secret%zz@127.0.0.1/d", "postgresql://u:p@secret@127.0.0.1/d",
                                          "postgresql://u:1/secret@127.0.0.1/d", "postgresql://u:secret"};
    (void)state;
    for (size_t i = 0; i < sizeof address / sizeof address[0]; i++) {
        struct store_place place = {0};
        struct store *store = NULL;
        struct error err = {0};
        snprintf(place.address, sizeof place.address, "%s", address[i]);
        assert_int_equal(store_open_place(&place, &store, &err), STATUS_INVALID);
        assert_non_null(strstr(err.text, "the address is malformed"));
        assert_null(strstr(err.text, "secret"));
    }
}

static void test_texts_that_are_cut_within_a_character_can_be_stored(void **state)
{
    struct fixture *f = *state;
    struct job_row row;
    add_job(f->one, "a", JOB_DRAFT);
    assert_int_equal(store_job_look(f->one, "a", &row, NULL), STATUS_OK);
    snprintf(row.error_text, sizeof row.error_text, "the worker said: \xc3");
    assert_int_equal(store_job_update(f->one, &row, NULL), STATUS_OK);
    assert_int_equal(store_job_look(f->two, "a", &row, NULL), STATUS_OK);
    assert_string_equal(row.error_text, "the worker said: ?");
}

static int run(const char *database)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(test_a_job_is_claimed_by_one),
        TEST(test_what_a_daemon_held_can_be_had_when_it_has_ended),
        TEST(test_many_jobs_without_a_daemon),
        TEST(test_a_claim_ends_with_the_state_that_it_was_for),
        TEST(test_a_lease_that_has_ended_is_removed_with_its_connections),
        TEST(test_the_gate_admits_one_for_a_job),
        TEST(test_a_change_whose_connection_is_lost_is_an_error_and_not_made),
        TEST(test_an_upload_goes_on_at_one_daemon),
        TEST(test_changes_at_one_daemon_are_told_to_others),
        TEST(test_a_connection_that_was_lost_may_have_missed_changes),
        cmocka_unit_test(test_a_password_in_a_malformed_address_is_not_quoted),
        TEST(test_texts_that_are_cut_within_a_character_can_be_stored),
    };
#undef TEST
    return cmocka_run_group_tests_name(database, tests, NULL, NULL);
}

int main(void) { return store_fixture_shared(run); }
