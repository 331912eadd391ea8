/* Which watches a change wakes, and what else ends a wait. */
#include "base/clock.h"
#include "server/jobs/change_feed.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

static enum change_wake look(struct change_watch *w) { return change_watch_wait(w, -1, clock_monotonic_s() + 0.01); }

static void test_a_change_wakes_its_job_and_the_list(void **state)
{
    struct change_feed *feed;
    struct change_watch *a, *b, *list;
    (void)state;
    assert_int_equal(change_feed_new(&feed, NULL), STATUS_OK);
    assert_int_equal(change_watch_begin(feed, "a", &a, NULL), STATUS_OK);
    assert_int_equal(change_watch_begin(feed, "b", &b, NULL), STATUS_OK);
    assert_int_equal(change_watch_begin(feed, NULL, &list, NULL), STATUS_OK);
    change_feed_publish(feed, "a");
    change_feed_publish(feed, "a");
    assert_int_equal(look(b), CHANGE_NONE);
    assert_int_equal(look(a), CHANGE_SEEN);
    assert_int_equal(look(list), CHANGE_SEEN);
    assert_int_equal(look(a), CHANGE_NONE); /* both changes were before the first look */
    change_watch_end(b);                    /* from the middle of the list of watches */
    change_feed_publish(feed, "b");
    assert_int_equal(look(a), CHANGE_NONE);
    assert_int_equal(look(list), CHANGE_SEEN);
    change_watch_end(list);
    change_watch_end(a);
    change_feed_free(feed);
}

static void test_a_peer_that_goes_away_ends_the_wait(void **state)
{
    struct change_feed *feed;
    struct change_watch *w;
    int pair[2];
    (void)state;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    assert_int_equal(change_feed_new(&feed, NULL), STATUS_OK);
    assert_int_equal(change_watch_begin(feed, NULL, &w, NULL), STATUS_OK);
    assert_int_equal(change_watch_wait(w, pair[0], clock_monotonic_s() + 0.01), CHANGE_NONE);
    close(pair[1]);
    assert_int_equal(change_watch_wait(w, pair[0], clock_monotonic_s() + 60), CHANGE_NO_PEER);
    close(pair[0]);
    change_watch_end(w);
    change_feed_free(feed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_a_change_wakes_its_job_and_the_list),
                                       cmocka_unit_test(test_a_peer_that_goes_away_ends_the_wait)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
