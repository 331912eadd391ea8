/* A precomputation that is interrupted again and again, with a journal that is damaged at its end: it goes on where it
 * was and ends with the bytes of one that was not interrupted. */
#include "base/files/durable.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/fast/precompute/precompute_journal.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct scene *scene;
static double param[SCATTERING_MAX_PARAM];

static int set_up(void **state)
{
    struct fiber_set f;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){true}, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    (void)state;
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    scene_free(scene);
    return 0;
}

static struct fast_precompute_request request(const char *journal)
{
    return (struct fast_precompute_request){.scene = scene,
                                            .model = scattering_find("two_lobe.v1"),
                                            .param = param,
                                            .n_path = 500,
                                            .cell_paths = 3,
                                            .journal_path = journal};
}

/* Cancels once the progress is a step beyond its first report. */
struct interruption {
    atomic_bool cancel;
    double first, step;
};

static void watch(void *context, double fraction)
{
    struct interruption *i = context;
    if (i->first < 0) i->first = fraction;
    if (fraction > i->first + i->step) atomic_store(&i->cancel, true);
}

/* An attempt; true: it came to its end, and its tables are at `path`. */
static bool attempt(const struct fast_precompute_request *q, double step, struct thread_pool *pool, const char *path)
{
    struct interruption i = {.first = -1, .step = step};
    struct progress progress = {.report = watch, .context = &i, .cancel = &i.cancel};
    struct fast_tables t;
    struct error err = {0};
    status s = fast_precompute(q, pool, &progress, &t, &err);
    if (s == STATUS_CANCELLED) return false;
    if (s != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(fast_tables_write(&t, path, &err), STATUS_OK);
    fast_tables_release(&t);
    return true;
}

static size_t length_of(const char *path)
{
    size_t n;
    free(scratch_read(path, &n));
    return n;
}

static void assert_same_file(const char *a, const char *b)
{
    size_t n, m;
    char *x = scratch_read(a, &n), *y = scratch_read(b, &m);
    assert_int_equal(n, m);
    assert_memory_equal(x, y, n);
    free(x);
    free(y);
}

static void interruptions_change_nothing(void **state)
{
    enum { INTERRUPTED = 4, RECORD_BYTES = 24, MOST_RECORD = 200 };
    char whole[256], pieces[256], once[256], journal[256];
    snprintf(whole, sizeof whole, "%s", scratch_path(state, "whole"));
    snprintf(once, sizeof once, "%s", scratch_path(state, "once"));
    snprintf(pieces, sizeof pieces, "%s", scratch_path(state, "pieces"));
    snprintf(journal, sizeof journal, "%s", scratch_path(state, "journal"));
    struct fast_precompute_request q = request(once), kept = request(journal);
    struct thread_pool *pool;
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    assert_true(attempt(&q, 2, pool, whole));
    int n = 1;
    for (size_t last = 0; !attempt(&kept, n < INTERRUPTED ? 0.2 : 2, n % 2 ? pool : NULL, pieces); n++) {
        size_t length = length_of(journal), n_byte;
        assert_true(n < INTERRUPTED && length >= last);
        last = length;
        char *text = scratch_read(journal, &n_byte); /* the last record was not written whole */
        if (n == 2) scratch_write(journal, text, n_byte - 7);
        if (n == 3) text[n_byte - 9] ^= 1, scratch_write(journal, text, n_byte);
        last = n == 2 || n == 3 ? 0 : last;
        free(text);
    }
    print_message("%d attempts, %zu bytes kept\n", n, length_of(journal));
    assert_true(n > 2);
    /* nothing was done twice but what was not kept: each row once, and no more than some heads of records */
    assert_true(length_of(journal) < length_of(once) + RECORD_BYTES * MOST_RECORD);
    assert_same_file(whole, pieces);
    thread_pool_free(pool);
}

/* What another request has kept is of no use; one without time between records keeps everything. */
static void journals_belong_to_their_request(void **state)
{
    char whole[256], other[256], journal[256];
    snprintf(whole, sizeof whole, "%s", scratch_path(state, "whole"));
    snprintf(other, sizeof other, "%s", scratch_path(state, "other"));
    snprintf(journal, sizeof journal, "%s", scratch_path(state, "journal"));
    struct fast_precompute_request q = request(journal);
    q.no_visibility = true;
    assert_true(attempt(&q, 2, NULL, whole));
    size_t complete = length_of(journal);
    q.cell_paths = 6;
    assert_true(attempt(&q, 2, NULL, other));
    assert_true(length_of(journal) < complete);
    size_t without = length_of(journal);
    assert_true(attempt(&q, 2, NULL, other));
    assert_int_equal(length_of(journal), without); /* nothing is done again */
    q.cell_paths = 3;
    assert_true(attempt(&q, 2, NULL, other));
    assert_same_file(whole, other);
    q.journal_path = "/nowhere/at/all";
    struct fast_tables t;
    struct error err = {0};
    assert_int_not_equal(fast_precompute(&q, NULL, NULL, &t, &err), STATUS_OK);
    assert_true(strlen(err.text) > 10);
}

/* Interrupted while paths of the table of deep light are traced: its finished rows are kept. */
static void deep_light_goes_on(void **state)
{
    char whole[256], pieces[256], cells[256], journal[256];
    snprintf(whole, sizeof whole, "%s", scratch_path(state, "whole"));
    snprintf(pieces, sizeof pieces, "%s", scratch_path(state, "pieces"));
    snprintf(cells, sizeof cells, "%s", scratch_path(state, "cells"));
    snprintf(journal, sizeof journal, "%s", scratch_path(state, "journal"));
    struct fast_precompute_request q = request(cells);
    struct thread_pool *pool;
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    q.no_visibility = true;
    assert_true(attempt(&q, 2, pool, whole));
    q.journal_path = journal;
    q.deep_traced = 1;
    q.deep_edge = 4;
    q.deep_paths = 40000;
    assert_false(attempt(&q, 0.85, pool, pieces)); /* the table is made from 0.73 on */
    size_t kept = length_of(journal);
    assert_true(kept > length_of(cells));
    assert_true(attempt(&q, 2, NULL, pieces));
    assert_true(length_of(journal) > kept);
    q.journal_path = NULL;
    assert_true(attempt(&q, 2, pool, whole));
    assert_same_file(whole, pieces);
    thread_pool_free(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(interruptions_change_nothing, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(journals_belong_to_their_request, scratch_folder_setup,
                                        scratch_folder_teardown),
        cmocka_unit_test_setup_teardown(deep_light_goes_on, scratch_folder_setup, scratch_folder_teardown),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
