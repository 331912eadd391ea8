/* A worker process: it has its own session, a lower priority, bounded resources, an environment of few variables, no
 * descriptor of the daemon's, and no way to gain privileges. The kernel kills it when the daemon dies
 * (PR_SET_PDEATHSIG), so after a crash of the daemon no worker is left that could write beside a new one. */
#ifndef SELVEDGE_SERVER_WORKER_PROCESS_H
#define SELVEDGE_SERVER_WORKER_PROCESS_H

#include "base/status.h"
#include "server/settings/settings.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

/* Paths of a worker that is to start. */
struct worker_paths {
    const char *program, *job_folder;
    const char *console;  /* gets stdout and stderr, and is made new */
    const char *speeds;   /* of earlier jobs */
    const char *document; /* a job document whose files in job_folder are judged; NULL: the job is run or planned */
    bool pictures;        /* the job has succeeded: its pictures are made (worker option --pictures) */
    bool plan;            /* the job is not run: its expected resources are reported */
    int report_fd;        /* gets the report of a check or a plan, in place of the console */
    int64_t threads;      /* computing threads; 0: as the settings say */
    int64_t ranks; /* processes that share the paths of the job, started by the worker; 0 and 1: none but itself */
};

/* The cause of a worker's end, as far as its engine knows more than the exit code. */
enum worker_cause {
    WORKER_ENDED,             /* itself, or a signal: see the exit code */
    WORKER_NOT_STARTED,       /* the engine could not be reached; nothing has run */
    WORKER_REFUSED,           /* the engine does not take the job */
    WORKER_CANCELLED_OUTSIDE, /* a user or operator of the engine */
    WORKER_INTERRUPTED,       /* the engine, which needs the node; the job goes on from its checkpoint */
    WORKER_OUT_OF_TIME,       /* the engine's time limit, without progress since the attempt before */
    WORKER_OUT_OF_MEMORY,
    WORKER_NODE_LOST,
    WORKER_VANISHED /* the engine does not know it any more */
};

struct worker_end {
    bool by_signal;
    int code; /* exit code or signal number */
    int64_t peak_rss_bytes;
    enum worker_cause cause;
    char why[400]; /* in words; "" with WORKER_ENDED */
};

/* The command line of a worker: argument is NULL after the last, which is the job's folder. */
struct worker_arguments {
    char memory_mib[24], scratch_mib[24], threads[24], ranks[24];
    const char *argument[20];
};

enum { WORKER_MAX_VARIABLE = 64 };
/* Collects the variables of the daemon's environment that workers get, and one more. Ends with NULL. */
void worker_environment(const struct settings *settings, const char *one_more, char *variable[WORKER_MAX_VARIABLE + 1]);
/* The paths must outlive the arguments. */
void worker_arguments_set(struct worker_arguments *a, const struct worker_paths *paths,
                          const struct settings *settings);
/* Starts a worker with the limits of the settings. To be called from a thread that lives as long as the daemon. Returns
 * when the program runs, so a daemon that is killed leaves no copy of itself that would hold its lock and socket.
 * STATUS_IO, STATUS_NO_MEMORY. */
status worker_launch(const struct worker_paths *paths, const struct settings *settings, pid_t *pid, struct error *err);
/* Returns false while the worker runs. */
bool worker_ended(pid_t pid, struct worker_end *end);
/* Memory that a running worker holds and that only its end gives back: anonymous and shared pages, in RAM or swapped
 * out. Pages of files that it maps are left out, because the kernel takes them back when memory is short. 0: not
 * known. */
int64_t worker_memory_bytes(pid_t pid);
/* Threads of a running worker. 0: not known. */
int64_t worker_thread_count(pid_t pid);
/* Sends a signal to the worker and all processes that it started. */
void worker_signal(pid_t pid, int signal_number);

#endif
