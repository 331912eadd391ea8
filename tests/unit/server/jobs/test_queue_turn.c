/* Whose turn it is: the rule of the queue, without a database. */
#include "server/jobs/queue_turn.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

static struct queued_job job(const char *owner, const char *batch, const char *id, int64_t priority, double queued)
{
    struct queued_job j = {.priority = priority, .queued_unix_s = queued};
    snprintf(j.id, sizeof j.id, "%s", id);
    snprintf(j.owner, sizeof j.owner, "%s", owner);
    snprintf(j.batch, sizeof j.batch, "%s", batch);
    return j;
}

/* Starts all jobs one after the other on one worker, each of which ends before the next one starts. */
static void expect_order(struct queue_turn *turn, const struct queued_job *list, size_t n, const char *expected)
{
    char text[64] = "";
    size_t i, n_text = 0;
    for (double now = 1000; (i = queue_turn_next(turn, now)) < n; now++)
        n_text += (size_t)snprintf(text + n_text, sizeof text - n_text, "%s", list[i].id);
    assert_string_equal(text, expected);
}

static void test_batches_of_an_owner_take_turns(void **state)
{
    (void)state;
    const struct queued_job list[] = {
        job("ann", "", "x", 0, 9),  job("ann", "", "y", 0, 10), job("ann", "A", "a", 0, 1), job("ann", "A", "b", 0, 2),
        job("ann", "A", "c", 0, 3), job("ann", "A", "d", 0, 4), job("ann", "B", "p", 0, 5)};
    struct queue_turn *turn = queue_turn_new(list, 7);
    assert_non_null(turn);
    /* nobody has run: the longest waiting first; then those whose last start is longest ago */
    expect_order(turn, list, 7, "apxbycd");
    queue_turn_free(turn);
}

static void test_priority_comes_before_turns_within_an_owner_alone(void **state)
{
    (void)state;
    const struct queued_job list[] = {job("ann", "A", "a", 5, 8), job("ann", "A", "b", 5, 9),
                                      job("ann", "B", "c", 0, 1), job("bob", "", "u", -10, 20),
                                      job("bob", "", "v", -10, 21)};
    struct queue_turn *turn = queue_turn_new(list, 5);
    expect_order(turn, list, 5, "aubvc");
    queue_turn_free(turn);
}

static void test_running_jobs_and_last_starts_count(void **state)
{
    (void)state;
    struct queued_job list[] = {job("ann", "A", "a", 0, 1), job("ann", "B", "b", 0, 2), job("bob", "", "u", 0, 3)};
    list[0].last_start_unix_s = 50;
    struct queue_turn *turn = queue_turn_new(list, 3);
    queue_turn_running(turn, "bob", "elsewhere", 1); /* counts for the owner, though the batch has no queue */
    assert_int_equal(queue_turn_next(turn, 60), 1);  /* of ann's batches the one that was never started */
    queue_turn_running(turn, "ann", "B", 1);
    queue_turn_running(turn, "bob", "elsewhere", -1);
    assert_int_equal(queue_turn_next(turn, 61), 2);
    assert_int_equal(queue_turn_next(turn, 62), 0);
    assert_int_equal(queue_turn_next(turn, 63), 3);
    queue_turn_free(turn);
}

static void test_jobs_that_may_not_start_are_passed_over(void **state)
{
    (void)state;
    const struct queued_job list[] = {job("ann", "A", "a", 0, 1), job("ann", "A", "b", 0, 2),
                                      job("ann", "B", "c", 0, 3)};
    struct queue_turn *turn = queue_turn_new(list, 3);
    queue_turn_skip(turn, 0);
    expect_order(turn, list, 3, "bc");
    queue_turn_free(turn);
    turn = queue_turn_new(list, 0);
    assert_int_equal(queue_turn_next(turn, 1), 0);
    queue_turn_free(turn);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_batches_of_an_owner_take_turns),
        cmocka_unit_test(test_priority_comes_before_turns_within_an_owner_alone),
        cmocka_unit_test(test_running_jobs_and_last_starts_count),
        cmocka_unit_test(test_jobs_that_may_not_start_are_passed_over),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
