/* The thread that removes jobs by the limits of the settings: none without limits, not before its time, and it ends
 * when it is told to. */
#include "base/clock.h"
#include "server/retention/retention_watch.h"
#include "tests/support/store/service_fixture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <time.h>

#include <cmocka.h>

static struct retention_watch *start(struct service_fixture *f, int64_t max_age_days, int64_t max_bytes,
                                     int64_t check_s)
{
    struct retention_watch *w = NULL;
    f->settings.retention_max_age_days = max_age_days;
    f->settings.retention_max_bytes = max_bytes;
    f->settings.retention_check_s = check_s;
    assert_int_equal(retention_watch_start(f->service, &w, NULL), STATUS_OK);
    return w;
}

static void wait_ms(long ms) { nanosleep(&(struct timespec){ms / 1000, ms % 1000 * 1000000}, NULL); }

/* Waits until the job is removed, for at most so long. */
static bool goes(struct service_fixture *f, const char *id, double most_s)
{
    const double end_s = clock_monotonic_s() + most_s;
    while (!service_fixture_row(f, id).deleted && clock_monotonic_s() < end_s) wait_ms(10);
    return service_fixture_row(f, id).deleted;
}

static void test_without_limits(void **state)
{
    assert_null(start(*state, 0, 0, 1));
    retention_watch_stop(NULL);
}

static void test_each_limit(void **state)
{
    struct service_fixture *f = *state;
    for (int by_size = 0; by_size < 2; by_size++) {
        char old[2][STORE_ID_BYTES], young[STORE_ID_BYTES];
        for (int i = 0; i < 2; i++) service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000 + i, old[i]);
        service_fixture_job(f, NULL, JOB_DRAFT, 0, young);
        struct retention_watch *w = start(f, by_size ? 0 : 1, by_size ? 1 : 0, 1);
        assert_non_null(w);
        for (int i = 0; i < 2; i++) assert_true(goes(f, old[i], 20));
        char later[STORE_ID_BYTES]; /* it looks again and again */
        service_fixture_job(f, NULL, JOB_FAILED, 1000, later);
        assert_true(goes(f, later, 20));
        assert_false(service_fixture_row(f, young).deleted);
        retention_watch_stop(w);
        assert_false(service_fixture_logged(f, "WARNING"));
    }
}

/* Who mistypes a limit can still stop the daemon, and need not wait for the end of the pause. */
static void test_the_first_look_has_its_time(void **state)
{
    struct service_fixture *f = *state;
    char id[STORE_ID_BYTES];
    service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000, id);
    struct retention_watch *w = start(f, 1, 0, 3600);
    assert_false(goes(f, id, 0.3));
    const double before_s = clock_monotonic_s();
    retention_watch_stop(w);
    assert_true(clock_monotonic_s() - before_s < 5);
    assert_false(service_fixture_row(f, id).deleted);
}

/* A daemon that is stopped while it removes jobs does not go on to the last one. */
static void test_a_stop_ends_the_removals(void **state)
{
    enum { MANY = 60 };
    struct service_fixture *f = *state;
    static char id[MANY][STORE_ID_BYTES];
    size_t n_gone = 0;
    for (int i = 0; i < MANY; i++) service_fixture_job(f, NULL, JOB_SUCCEEDED, 1000 + i, id[i]);
    struct retention_watch *w = start(f, 1, 0, 1);
    assert_true(goes(f, id[0], 20));
    retention_watch_stop(w);
    for (int i = 0; i < MANY; i++) n_gone += service_fixture_row(f, id[i]).deleted;
    assert_true(n_gone < MANY);
}

int main(void)
{
#define WITH_SERVICE(test) cmocka_unit_test_setup_teardown(test, service_fixture_setup, service_fixture_teardown)
    const struct CMUnitTest tests[] = {WITH_SERVICE(test_without_limits), WITH_SERVICE(test_each_limit),
                                       WITH_SERVICE(test_the_first_look_has_its_time),
                                       WITH_SERVICE(test_a_stop_ends_the_removals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
