/* Thread pool: every task runs once, the result is the same for any number of threads; cancellation, progress. */
#include "base/thread_pool.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { N_TASK = 1000 };

struct work {
    uint64_t result[N_TASK];
    unsigned n_run[N_TASK];
    size_t n_thread;
    atomic_int bad_thread;
    atomic_bool *cancel;
    size_t cancel_at;
};

static void task(void *context, size_t i, size_t i_thread)
{
    struct work *w = context;
    uint64_t x = i + 1;
    for (int k = 0; k < 200; k++) x = x * 6364136223846793005u + 1442695040888963407u;
    w->result[i] = x;
    w->n_run[i]++;
    if (i_thread >= w->n_thread) atomic_store(&w->bad_thread, 1);
    if (w->cancel != NULL && i == w->cancel_at) atomic_store(w->cancel, true);
}

static void test_every_task_once_for_any_number_of_threads(void **state)
{
    (void)state;
    static struct work reference, w;
    memset(&reference, 0, sizeof reference);
    reference.n_thread = 1;
    assert_int_equal(thread_pool_run(NULL, N_TASK, task, &reference, NULL), STATUS_OK);
    assert_int_equal(thread_pool_n_thread(NULL), 1);
    for (size_t n = 1; n <= 5; n++) {
        struct thread_pool *pool;
        struct error err;
        assert_int_equal(thread_pool_new(n, &pool, &err), STATUS_OK);
        assert_int_equal(thread_pool_n_thread(pool), n);
        for (int again = 0; again < 20; again++) { /* a pool is used many times */
            memset(&w, 0, sizeof w);
            w.n_thread = n;
            assert_int_equal(thread_pool_run(pool, N_TASK, task, &w, NULL), STATUS_OK);
            assert_memory_equal(w.result, reference.result, sizeof w.result);
            for (size_t i = 0; i < N_TASK; i++) assert_int_equal(w.n_run[i], 1);
            assert_int_equal(atomic_load(&w.bad_thread), 0);
        }
        assert_int_equal(thread_pool_run(pool, 0, task, &w, NULL), STATUS_OK);
        thread_pool_free(pool);
    }
    thread_pool_free(NULL);
}

static void test_default_is_at_least_one_thread(void **state)
{
    (void)state;
    struct thread_pool *pool;
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    assert_true(thread_pool_n_thread(pool) >= 1);
    thread_pool_free(pool);
}

static void test_too_many_threads_are_refused(void **state)
{
    (void)state;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    assert_int_equal(thread_pool_new(SIZE_MAX / 2, &pool, &err), STATUS_NO_MEMORY);
    assert_null(pool);
}

static void test_cancellation(void **state)
{
    (void)state;
    static struct work w;
    for (size_t n = 0; n <= 2; n++) {
        struct thread_pool *pool = NULL;
        if (n > 0) assert_int_equal(thread_pool_new(n, &pool, NULL), STATUS_OK);
        atomic_bool cancel = false;
        const struct progress progress = {.cancel = &cancel};
        memset(&w, 0, sizeof w);
        w.n_thread = n == 0 ? 1 : n;
        w.cancel = &cancel;
        w.cancel_at = 10;
        assert_int_equal(thread_pool_run(pool, N_TASK, task, &w, &progress), STATUS_CANCELLED);
        size_t n_run = 0;
        for (size_t i = 0; i < N_TASK; i++) n_run += w.n_run[i];
        assert_true(n_run >= 1 && n_run < N_TASK);
        assert_int_equal(thread_pool_run(pool, N_TASK, task, &w, &progress), STATUS_CANCELLED);
        w.cancel = NULL;
        atomic_store(&cancel, false);
        assert_int_equal(thread_pool_run(pool, N_TASK, task, &w, &progress), STATUS_OK);
        thread_pool_free(pool);
    }
}

struct heard {
    double last;
    size_t n;
    int fell;
};

static void hear(void *context, double fraction)
{
    struct heard *h = context;
    if (fraction < h->last) h->fell = 1;
    h->last = fraction;
    h->n++;
}

static bool keeps_denormals(void)
{
    volatile double small = 2.5e-308;
    volatile double tenth = 0.1 * small;
    return tenth > 0.0;
}

static void count_flushed(void *context, size_t i, size_t i_thread)
{
    (void)i, (void)i_thread;
    if (!keeps_denormals()) atomic_fetch_add((atomic_size_t *)context, 1);
}

/* A resumed job may use the pool at another time than an uninterrupted one. The calling thread must therefore compute
 * the same before and after its first use. */
static void test_caller_computes_as_before(void **state)
{
    (void)state;
    for (size_t n_thread = 0; n_thread <= 2; n_thread++) {
        struct thread_pool *pool = NULL;
        atomic_size_t n_flushed = 0;
        if (n_thread > 0) assert_int_equal(thread_pool_new(n_thread, &pool, NULL), STATUS_OK);
        assert_true(keeps_denormals());
        assert_int_equal(thread_pool_run(pool, 100, count_flushed, &n_flushed, NULL), STATUS_OK);
        assert_true(keeps_denormals());
#if defined(__SSE2__) || defined(__aarch64__)
        assert_int_equal(n_flushed, 100);
#endif
        thread_pool_free(pool);
    }
}

static void test_progress_rises_to_one(void **state)
{
    (void)state;
    static struct work w;
    for (size_t n = 0; n <= 3; n++) {
        struct thread_pool *pool = NULL;
        if (n > 0) assert_int_equal(thread_pool_new(n, &pool, NULL), STATUS_OK);
        struct heard heard = {0};
        const struct progress progress = {.report = hear, .context = &heard};
        w.n_thread = n == 0 ? 1 : n;
        w.cancel = NULL;
        assert_int_equal(thread_pool_run(pool, N_TASK, task, &w, &progress), STATUS_OK);
        assert_int_equal(heard.n, N_TASK);
        assert_int_equal(heard.fell, 0);
        assert_true(heard.last == 1.0);
        thread_pool_free(pool);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_task_once_for_any_number_of_threads),
        cmocka_unit_test(test_default_is_at_least_one_thread),
        cmocka_unit_test(test_too_many_threads_are_refused),
        cmocka_unit_test(test_cancellation),
        cmocka_unit_test(test_caller_computes_as_before),
        cmocka_unit_test(test_progress_rises_to_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
