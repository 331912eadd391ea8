/* Estimates and pictures that two ranks share: the same bits as those of one rank. */
#include "base/ranks/byte_pack.h"
#include "base/ranks/rank_team.h"
#include "renderer/estimate/rank_orders.h"
#include "tests/support/ranks/two_ranks.h"
#include "tests/support/tracer/estimate_fixture.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include <cmocka.h>

static struct estimate_fixture fixture;

static int set_up(void **state)
{
    (void)state;
    signal(SIGPIPE, SIG_IGN);
    return estimate_fixture_init(&fixture);
}

static int tear_down(void **state)
{
    (void)state;
    estimate_fixture_release(&fixture);
    return 0;
}

/* The tasks of two replicas are shared at once: the same bits as one after the other. */
static void two_replicas_at_once(struct estimate_request *q, const struct estimate *first, struct thread_pool *pool)
{
    struct estimate next[4], both[8];
    struct error err = {0};
    q->replica++;
    estimate_fixture_run(q, 1, next);
    q->replica--;
    q->next_replica_too = true;
    assert_int_equal(estimate_run(q, pool, NULL, both, &err), STATUS_OK);
    assert_memory_equal(both, first, sizeof next);
    assert_memory_equal(both + 4, next, sizeof next);
    q->next_replica_too = false;
}

/* Means, a mean over rotations, a contrast, shared paths: with 1 and 2 threads a rank. */
static void two_ranks_estimate_the_same_bits(void **state)
{
    (void)state;
    enum { N = 4 };
    const size_t n_path[N] = {3000, 1280, 0, 2000};
    for (size_t n_thread = 1; n_thread <= 2; n_thread++)
        for (int how = 0; how < 3; how++) {
            struct configuration c[N];
            struct estimate alone[N], together[N];
            struct two_ranks r;
            struct error err = {0};
            struct estimate_request q = estimate_fixture_request(&fixture, n_path, N);
            memcpy(c, q.configuration, sizeof c);
            if (how == 1) c[1].n_rotation = 3;
            if (how == 2) c[3].contrast_cells = 6;
            q.configuration = c;
            q.share_camera_paths = how == 0;
            estimate_fixture_run(&q, 1, alone);
            two_ranks_start(&r, n_thread);
            for (int again = 0; again < 2; again++) {
                assert_int_equal(estimate_run(&q, r.pool, NULL, together, &err), STATUS_OK);
                assert_memory_equal(alone, together, sizeof alone);
            }
            if (how != 1) two_replicas_at_once(&q, alone, r.pool);
            assert_true(rank_team_traffic(r.team).result_bytes > 0); /* the helper has done a part of it */
            assert_int_equal(rank_team_traffic(r.team).n_order, how != 1 ? 4 : 3); /* the cloth is sent once */
            assert_int_equal(two_ranks_end(&r), 0);
        }
}

static void two_ranks_render_the_same_bits(void **state)
{
    (void)state;
    const size_t n_path[1] = {256};
    struct estimate_request e = estimate_fixture_request(&fixture, n_path, 1);
    const struct render_request q = {
        .input = e.input, .configuration = e.configuration, .width = 24, .height = 16, .n_sample = 40, .seed = 3};
    struct image alone, together;
    struct two_ranks r;
    struct error err = {0};
    assert_int_equal(render_run(&q, NULL, NULL, &alone, &err), STATUS_OK);
    two_ranks_start(&r, 1);
    assert_int_equal(render_run(&q, r.pool, NULL, &together, &err), STATUS_OK);
    assert_true(rank_team_traffic(r.team).result_bytes > 0);
    assert_memory_equal(alone.pixel, together.pixel, 24 * 16 * alone.n_channel * sizeof *alone.pixel);
    assert_int_equal(two_ranks_end(&r), 0);
    image_release(&alone);
    image_release(&together);
}

static void set_cancel(void *context, double fraction)
{
    if (fraction > 0.02) atomic_store((atomic_bool *)context, true);
}

/* A cancelled estimate ends soon in both ranks, and the next one is whole. */
static void a_cancelled_estimate_leaves_no_trace(void **state)
{
    (void)state;
    const size_t few[2] = {4096, 4096}, many[2] = {100000, 100000};
    struct estimate alone[2], together[2];
    struct two_ranks r;
    struct error err = {0};
    atomic_bool cancel = false;
    const struct progress progress = {.report = set_cancel, .context = &cancel, .cancel = &cancel};
    struct estimate_request q = estimate_fixture_request(&fixture, few, 2);
    estimate_fixture_run(&q, 1, alone);
    two_ranks_start(&r, 1);
    q.n_path = many;
    for (int again = 0; again < 2; again++) { /* before it begins, and in the middle */
        atomic_store(&cancel, again == 0);
        assert_int_equal(estimate_run(&q, r.pool, &progress, together, &err), STATUS_CANCELLED);
    }
    q.n_path = few;
    assert_int_equal(estimate_run(&q, r.pool, NULL, together, &err), STATUS_OK);
    assert_memory_equal(alone, together, sizeof alone);
    assert_int_equal(two_ranks_end(&r), 0);
}

static void ranks_of_another_program_are_refused(void **state)
{
    (void)state;
    struct two_ranks r;
    struct error err = {0};
    two_ranks_start(&r, 1);
    assert_int_equal(rank_orders_agree(r.team, "the test", &err), STATUS_OK);
    assert_int_equal(rank_orders_agree(r.team, "another", &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "this rank runs 'the test', rank 0 runs 'another'"));
    assert_int_equal(two_ranks_end(&r), 0);
}

static void a_lost_helper_ends_the_estimate(void **state)
{
    (void)state;
    const size_t n_path[1] = {2000000};
    struct estimate out[1];
    struct two_ranks r;
    struct error err = {0};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 1);
    two_ranks_start(&r, 1);
    kill(r.helper, SIGKILL);
    assert_int_equal(estimate_run(&q, r.pool, NULL, out, &err), STATUS_IO);
    assert_true(rank_team_broken(r.team));
    assert_int_equal(WTERMSIG(two_ranks_end(&r)), SIGKILL);
}

static void views_never_read_more_than_there_is(void **state)
{
    (void)state;
    const uint32_t words[3] = {1, 2, 3};
    struct byte_pack p = {0};
    struct error err = {0};
    byte_pack_put(&p, words, sizeof words);
    assert_int_equal(byte_pack_check(&p, &err), STATUS_OK);
    struct byte_view v = {.data = p.data, .n = p.n};
    uint32_t first, *rest;
    BYTE_VIEW(&v, first);
    assert_int_equal(first, 1);
    assert_int_equal(byte_view_check(&v, &err), STATUS_FORMAT); /* something is left */
    assert_null(byte_view_array(&(struct byte_view){.data = v.data, .n = v.n}, SIZE_MAX / 2, 4));
    rest = byte_view_array(&v, 2, sizeof *rest);
    assert_memory_equal(rest, words + 1, 2 * sizeof *rest);
    assert_int_equal(byte_view_check(&v, &err), STATUS_OK);
    BYTE_VIEW(&v, first);
    assert_int_equal(first, 0);
    assert_int_equal(byte_view_check(&v, &err), STATUS_FORMAT);
    free(rest);
    byte_pack_release(&p);
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(two_ranks_estimate_the_same_bits),     cmocka_unit_test(two_ranks_render_the_same_bits),
        cmocka_unit_test(a_cancelled_estimate_leaves_no_trace), cmocka_unit_test(ranks_of_another_program_are_refused),
        cmocka_unit_test(a_lost_helper_ends_the_estimate),      cmocka_unit_test(views_never_read_more_than_there_is)};
    return cmocka_run_group_tests(test, set_up, tear_down);
}
