/* Where workers run: a table of functions for each engine. The supervisor decides which job starts, when it must stop
 * and how its end changes the job; a backend carries that out. All calls come from the supervisor's thread, and none of
 * them waits for an engine. */
#ifndef SELVEDGE_SERVER_JOB_BACKEND_H
#define SELVEDGE_SERVER_JOB_BACKEND_H

#include "server/jobs/job_service.h"
#include "server/workers/backends/worker_process.h"

/* BACKEND_WAITS: the engine has the job, but its worker does not compute: it waits for a node, or is suspended. */
enum backend_phase { BACKEND_WAITS, BACKEND_RUNS, BACKEND_ENDED };

struct backend_run; /* one start of a worker, as its backend knows it */

struct job_backend {
    const char *name;     /* the value of jobs.backend */
    bool outlives_daemon; /* workers go on while no daemon runs, and the next daemon adopts them */
    int look_ms;          /* time between two looks at workers that run */
    /* Called once. The service and the program's path outlive the state. */
    status (*open)(struct job_service *v, const char *program, void **state, struct error *err);
    void (*close)(void *state);
    /* Whether a job may be started now: false while the engine cannot be reached. */
    bool (*ready)(void *state);
    /* Starts the worker of a job that attempt_prepare has prepared. */
    status (*start)(void *state, const char *job_id, struct backend_run **run, struct error *err);
    /* Takes over a job that an earlier daemon has started; NULL where none outlives its daemon. */
    status (*adopt)(void *state, const char *job_id, struct backend_run **run, struct error *err);
    /* end: set with BACKEND_ENDED. */
    enum backend_phase (*look)(void *state, struct backend_run *run, struct worker_end *end);
    /* Asks the worker to write a checkpoint and end, or ends it at once. */
    void (*stop)(void *state, struct backend_run *run, bool at_once);
    /* Memory that the worker holds (worker_memory_bytes); 0: not known, or bounded by the engine. */
    int64_t (*memory_bytes)(const struct backend_run *run);
    /* Threads of the worker (worker_thread_count); NULL, or 0: not known. */
    int64_t (*thread_count)(const struct backend_run *run);
    /* A descriptor that becomes readable when the worker ends; -1: there is none. */
    int (*end_fd)(const struct backend_run *run);
    /* Writes why the engine cannot be used at present, or "". From any thread. NULL: it always can. */
    void (*trouble)(void *state, char *text, size_t n_text);
    /* Forgets a run; its worker, if it still runs, is left alone. */
    void (*release)(void *state, struct backend_run *run);
};

extern const struct job_backend backend_local, backend_slurm;

/* Returns NULL when there is none of this name. */
const struct job_backend *job_backend_find(const char *name);

#endif
