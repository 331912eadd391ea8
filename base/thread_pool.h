/* A fixed set of threads that runs numbered tasks. Which thread runs which task is not determined, so a task
 * writes only to its own slot and the caller reduces the slots in order: that keeps results independent of n_thread. */
#ifndef SELVEDGE_BASE_THREAD_POOL_H
#define SELVEDGE_BASE_THREAD_POOL_H

#include "base/progress.h"
#include "base/status.h"

struct thread_pool;

/* n_thread = 0: one per available processor (affinity mask). The caller of thread_pool_run is one of them. Flush-to-zero and
 * denormals-are-zero are set while tasks run, as Embree wants; in the caller only that long. STATUS_NO_MEMORY. */
status thread_pool_new(size_t n_thread, struct thread_pool **pool, struct error *err);
void thread_pool_free(struct thread_pool *pool);
size_t thread_pool_n_thread(const struct thread_pool *pool);

/* A task: i_task in 0..n_task-1, i_thread in 0..n_thread-1 (for scratch memory). */
typedef void (*task_function)(void *context, size_t i_task, size_t i_thread);

/* Run all tasks and wait. pool == NULL runs them in the caller. Not reentrant. Reports tasks done / n_task to
 * progress (NULL allowed). STATUS_CANCELLED when progress->cancel was set before all tasks had been started; nothing else fails. */
status thread_pool_run(struct thread_pool *pool, size_t n_task, task_function run, void *context,
                       const struct progress *progress);

#endif
