/* Leases of two daemons on one database: how they are renewed, and when one daemon takes over from another. */
#include "base/clock.h"
#include "server/store/store_cluster.h"
#include "server/store/store_rows.h"
#include "server/workers/lease_keeper.h"
#include "tests/support/store/store_fixture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { LEASE_S = 60 };

/* Two stores of one database, as two daemons have them. All tests use the same. */
static struct store_fixture db;
static struct store *one, *two;

static int open_stores(void **state)
{
    (void)state;
    one = two = NULL;
    if (store_fixture_begin(&db) != 0) return 1;
    one = db.store;
    return store_open_place(&db.place, &two, NULL) != STATUS_OK;
}

static int close_stores(void **state)
{
    (void)state;
    store_close(two);
    store_fixture_end(&db);
    return 0;
}

/* Both daemons begin; `one` is the elder. */
static int set_up(void **state)
{
    (void)state;
    store_daemon_end(one, NULL);
    store_daemon_end(two, NULL);
    return store_daemon_begin(one, "here", 1, LEASE_S, NULL) != STATUS_OK ||
           store_daemon_begin(two, "there", 2, LEASE_S, NULL) != STATUS_OK;
}

static size_t count_daemons(void)
{
    struct daemon_row *row = NULL;
    size_t n = 0;
    assert_int_equal(store_daemon_list(one, &row, &n, NULL), STATUS_OK);
    free(row);
    return n;
}

/* Locks the row of a daemon, as somebody does who changes it, until unlock_row. */
static void lock_row(struct store *by, struct store *of)
{
    char id[STORE_ID_BYTES];
    store_daemon_id(of, id);
    pthread_mutex_lock(&by->write.lock);
    assert_int_equal(store_begin(&by->write, NULL), STATUS_OK);
    assert_int_equal(store_run(&by->write, NULL, NULL, "UPDATE daemon SET url = 'x' WHERE id = ?", "s", id), STATUS_OK);
}

static void unlock_row(struct store *by)
{
    assert_int_equal(store_end(&by->write, STATUS_OK, NULL), STATUS_OK);
    pthread_mutex_unlock(&by->write.lock);
}

static void test_a_renewal_waits_for_no_change(void **state)
{
    bool held = false;
    (void)state;
    pthread_mutex_lock(&one->write.lock); /* as a long transaction does */
    alarm(60);
    assert_int_equal(store_daemon_renew(one, LEASE_S, &held, NULL), STATUS_OK);
    assert_true(held);
    alarm(0);
    pthread_mutex_unlock(&one->write.lock);
}

static void test_a_renewal_that_finds_its_row_locked_fails_within_the_lease(void **state)
{
    struct error err = {0};
    bool held = false;
    (void)state;
    lock_row(two, one);
    const double begin_s = clock_monotonic_s();
    assert_int_equal(store_daemon_renew(one, 2, &held, &err), STATUS_CONFLICT);
    assert_true(clock_monotonic_s() - begin_s < 2);
    assert_non_null(strstr(err.text, "repeat the request"));
    unlock_row(two);
    assert_int_equal(store_daemon_renew(one, 2, &held, NULL), STATUS_OK);
    assert_true(held);
}

static void test_a_daemon_does_not_remove_itself(void **state)
{
    int n = 0;
    bool held = false;
    (void)state;
    assert_int_equal(store_daemon_renew(one, -1, &held, NULL), STATUS_OK); /* it ended a second ago */
    assert_int_equal(store_daemons_remove(one, LEASE_S, &n, NULL), STATUS_OK);
    assert_int_equal(n, 0);
    assert_int_equal(count_daemons(), 2);
}

static void test_the_eldest_is_one_that_lives(void **state)
{
    bool held = false;
    struct job_service first = {.store = one}, second = {.store = two};
    (void)state;
    assert_true(lease_keeper_is_eldest(&first));
    assert_false(lease_keeper_is_eldest(&second));
    /* after a power loss the rows of the daemons that it ended are there */
    assert_int_equal(store_daemon_renew(one, -1, &held, NULL), STATUS_OK);
    assert_true(lease_keeper_is_eldest(&second));
}

/* What holds up the renewal of one daemon may have held up those of the others. */
static void test_a_daemon_whose_renewal_was_held_up_takes_nothing_over(void **state)
{
    const struct settings settings = {.lease_s = 1};
    struct job_service v = {.settings = &settings, .store = one};
    struct lease_keeper *keeper = NULL;
    bool held = false;
    (void)state;
    store_daemon_end(one, NULL);
    assert_int_equal(lease_keeper_start(&v, &keeper, NULL), STATUS_OK);
    usleep(1200000); /* from here on it may take over */
    /* for longer than the pause between renewals and a quarter of a lease, and about as long as a renewal waits */
    lock_row(two, one);
    usleep(100000); /* a renewal that was before the lock is over */
    assert_int_equal(store_daemon_renew(two, -1, &held, NULL), STATUS_OK); /* as if it could not renew it either */
    usleep(420000);
    unlock_row(two);
    lease_keeper_stop(keeper); /* after the renewal that the lock has held up, and its own row ends with it */
    assert_int_equal(store_daemon_renew(two, LEASE_S, &held, NULL), STATUS_OK);
    assert_true(held);
}

static int run(const char *database)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(test_a_renewal_waits_for_no_change, set_up),
        cmocka_unit_test_setup(test_a_renewal_that_finds_its_row_locked_fails_within_the_lease, set_up),
        cmocka_unit_test_setup(test_a_daemon_does_not_remove_itself, set_up),
        cmocka_unit_test_setup(test_the_eldest_is_one_that_lives, set_up),
        cmocka_unit_test_setup(test_a_daemon_whose_renewal_was_held_up_takes_nothing_over, set_up),
    };
    return cmocka_run_group_tests_name(database, tests, open_stores, close_stores);
}

int main(void) { return store_fixture_shared(run); }
