/* A fixed set of threads that runs numbered tasks. It is not determined which thread runs which task. A task
 * therefore writes only to a slot of its own, and the caller combines the slots in order; so results do not depend
 * on n_thread. */
#ifndef SELVEDGE_BASE_THREAD_POOL_H
#define SELVEDGE_BASE_THREAD_POOL_H

#include "base/progress.h"
#include "base/status.h"

struct thread_pool;
struct rank_team; /* base/ranks/rank_team.h */

/* n_thread = 0: one thread for each available processor (affinity mask). The caller of thread_pool_run is one of
 * them. Flush-to-zero and denormals-are-zero are set while tasks run, as Embree requires, and restored in the caller
 * afterwards. STATUS_NO_MEMORY. */
status thread_pool_new(size_t n_thread, struct thread_pool **pool, struct error *err);
void thread_pool_free(struct thread_pool *pool);
size_t thread_pool_n_thread(const struct thread_pool *pool);

/* A task: i_task is in 0..n_task-1, i_thread in 0..n_thread-1 (to select scratch memory). */
typedef void (*task_function)(void *context, size_t i_task, size_t i_thread);

/* Runs all tasks and waits for them. pool == NULL runs them in the caller. Not reentrant. Reports the completed
 * share of the tasks to progress (may be NULL). STATUS_CANCELLED when progress->cancel was set before all tasks had
 * started; there are no other errors. */
status thread_pool_run(struct thread_pool *pool, size_t n_task, task_function run, void *context,
                       const struct progress *progress);

/* Gives the next task to a thread. Returns false when there is none left for it. Called by all threads at a time. */
typedef bool (*task_source)(void *context, size_t i_thread, size_t *i_task);
/* Runs tasks until the source has none left for any thread. context: of both functions. */
void thread_pool_run_from(struct thread_pool *pool, task_source source, task_function run, void *context);

/* The ranks that share tasks with this pool; NULL: there are none. The pool does not own them. */
void thread_pool_join_team(struct thread_pool *pool, struct rank_team *team);
struct rank_team *thread_pool_team(const struct thread_pool *pool);

#endif
