#include "base/thread_pool.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <unistd.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

struct thread_pool {
    pthread_mutex_t lock;
    pthread_cond_t work, done;
    pthread_t *thread;
    size_t n_thread;   /* including the caller of thread_pool_run, which is thread 0 */
    size_t n_started;  /* number of helper threads that run */
    size_t generation; /* number of the present call of thread_pool_run */
    size_t n_busy;
    bool stop;

    task_function run;
    task_source source; /* NULL: the tasks 0 .. n_task - 1 */
    void *context;
    const struct progress *progress;
    size_t n_task;
    atomic_size_t next;
    size_t n_done;
    struct rank_team *team;
};

struct start_argument {
    struct thread_pool *pool;
    size_t i_thread;
};

/* Returns the control word of the thread's floating-point unit. */
static unsigned long float_mode(void)
{
#if defined(__SSE2__)
    return _mm_getcsr();
#elif defined(__aarch64__)
    unsigned long fpcr;
    __asm__ volatile("mrs %0, fpcr" : "=r"(fpcr));
    return fpcr;
#else
    return 0;
#endif
}

static void set_float_mode(unsigned long mode)
{
#if defined(__SSE2__)
    _mm_setcsr((unsigned int)mode);
#elif defined(__aarch64__)
    __asm__ volatile("msr fpcr, %0" : : "r"(mode));
#else
    (void)mode;
#endif
}

static void set_flush_to_zero(void)
{
#if defined(__SSE2__)
    set_float_mode(float_mode() | 0x8040u); /* flush-to-zero, denormals-are-zero */
#elif defined(__aarch64__)
    set_float_mode(float_mode() | 1ul << 24);
#endif
}

static size_t available_processors(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0) {
        int n = CPU_COUNT(&set);
        if (n > 0) return (size_t)n;
    }
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    return n > 0 ? (size_t)n : 1;
}

static void run_tasks(struct thread_pool *p, size_t i_thread)
{
    if (p->source != NULL) {
        for (size_t i; p->source(p->context, i_thread, &i);) p->run(p->context, i, i_thread);
        return;
    }
    while (!progress_cancelled(p->progress)) {
        size_t i = atomic_fetch_add(&p->next, 1);
        if (i >= p->n_task) break;
        p->run(p->context, i, i_thread);
        pthread_mutex_lock(&p->lock);
        p->n_done++;
        progress_report(p->progress, (double)p->n_done / (double)p->n_task);
        pthread_mutex_unlock(&p->lock);
    }
}

static void *helper_main(void *argument)
{
    struct start_argument a = *(struct start_argument *)argument;
    free(argument);
    struct thread_pool *p = a.pool;
    set_flush_to_zero();
    size_t seen = 0;
    for (;;) {
        pthread_mutex_lock(&p->lock);
        while (!p->stop && p->generation == seen) pthread_cond_wait(&p->work, &p->lock);
        seen = p->generation;
        bool stop = p->stop;
        pthread_mutex_unlock(&p->lock);
        if (stop) return NULL;
        run_tasks(p, a.i_thread);
        pthread_mutex_lock(&p->lock);
        if (--p->n_busy == 0) pthread_cond_signal(&p->done);
        pthread_mutex_unlock(&p->lock);
    }
}

status thread_pool_new(size_t n_thread, struct thread_pool **pool, struct error *err)
{
    struct thread_pool *p = calloc(1, sizeof *p);
    if (p == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make thread pool: out of memory");
    if (n_thread == 0) n_thread = available_processors();
    p->n_thread = n_thread;
    pthread_mutex_init(&p->lock, NULL);
    pthread_cond_init(&p->work, NULL);
    pthread_cond_init(&p->done, NULL);
    p->thread = calloc(n_thread, sizeof *p->thread);
    if (p->thread == NULL) {
        thread_pool_free(p);
        return error_set(err, STATUS_NO_MEMORY, "cannot make thread pool: out of memory");
    }
    for (size_t i = 1; i < n_thread; i++) {
        struct start_argument *a = malloc(sizeof *a);
        int failed = a == NULL;
        if (!failed) {
            *a = (struct start_argument){p, i};
            failed = pthread_create(&p->thread[i], NULL, helper_main, a);
        }
        if (failed) {
            free(a);
            thread_pool_free(p);
            return error_set(err, STATUS_NO_MEMORY, "cannot start thread %zu of %zu", i + 1, n_thread);
        }
        p->n_started++;
    }
    *pool = p;
    return STATUS_OK;
}

void thread_pool_free(struct thread_pool *p)
{
    if (p == NULL) return;
    pthread_mutex_lock(&p->lock);
    p->stop = true;
    pthread_cond_broadcast(&p->work);
    pthread_mutex_unlock(&p->lock);
    for (size_t i = 1; i <= p->n_started; i++) pthread_join(p->thread[i], NULL);
    pthread_mutex_destroy(&p->lock);
    pthread_cond_destroy(&p->work);
    pthread_cond_destroy(&p->done);
    free(p->thread);
    free(p);
}

size_t thread_pool_n_thread(const struct thread_pool *p) { return p == NULL ? 1 : p->n_thread; }

static status run_in_caller(size_t n_task, task_function run, void *context, const struct progress *progress)
{
    for (size_t i = 0; i < n_task; i++) {
        if (progress_cancelled(progress)) return STATUS_CANCELLED;
        run(context, i, 0);
        progress_report(progress, (double)(i + 1) / (double)n_task);
    }
    return STATUS_OK;
}

/* The tasks that the caller has written to p. */
static status run_in_all(struct thread_pool *p)
{
    pthread_mutex_lock(&p->lock);
    p->n_done = 0;
    atomic_store(&p->next, 0);
    p->n_busy = p->n_started;
    p->generation++;
    pthread_cond_broadcast(&p->work);
    pthread_mutex_unlock(&p->lock);
    run_tasks(p, 0);
    pthread_mutex_lock(&p->lock);
    while (p->n_busy > 0) pthread_cond_wait(&p->done, &p->lock);
    bool complete = p->n_done == p->n_task;
    pthread_mutex_unlock(&p->lock);
    return complete ? STATUS_OK : STATUS_CANCELLED;
}

/* Restores the caller's floating-point mode, so that its later results do not depend on whether it has used a pool. */
status thread_pool_run(struct thread_pool *p, size_t n_task, task_function run, void *context,
                       const struct progress *progress)
{
    unsigned long mode = float_mode();
    status s;
    set_flush_to_zero();
    if (p == NULL) {
        s = run_in_caller(n_task, run, context, progress);
    } else {
        p->run = run;
        p->source = NULL;
        p->context = context;
        p->progress = progress;
        p->n_task = n_task;
        s = run_in_all(p);
    }
    set_float_mode(mode);
    return s;
}

void thread_pool_run_from(struct thread_pool *p, task_source source, task_function run, void *context)
{
    unsigned long mode = float_mode();
    set_flush_to_zero();
    p->run = run;
    p->source = source;
    p->context = context;
    p->progress = NULL;
    p->n_task = 0;
    run_in_all(p);
    set_float_mode(mode);
}

void thread_pool_join_team(struct thread_pool *p, struct rank_team *team) { p->team = team; }
struct rank_team *thread_pool_team(const struct thread_pool *p) { return p == NULL ? NULL : p->team; }
