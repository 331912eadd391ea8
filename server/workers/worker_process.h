/* A worker process: it has its own session, a lower priority, bounded resources, an environment of few variables, no
 * descriptor of the daemon's, and no way to gain privileges. The kernel kills it when the daemon dies
 * (PR_SET_PDEATHSIG), so after a crash of the daemon no worker is left that could write beside a new one. */
#ifndef SELVEDGE_SERVER_WORKER_PROCESS_H
#define SELVEDGE_SERVER_WORKER_PROCESS_H

#include "base/status.h"
#include "server/settings.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

/* Paths of a worker that is to start. */
struct worker_paths {
    const char *program, *job_folder;
    const char *console;  /* gets stdout and stderr, and is made new */
    const char *speeds;   /* of earlier jobs */
    const char *document; /* a job document whose files in job_folder are judged; NULL: the job is run */
    int report_fd;        /* gets what is found by a check, in place of console and speeds */
};

struct worker_end {
    bool by_signal;
    int code; /* exit code or signal number */
    int64_t peak_rss_bytes;
};

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
/* Sends a signal to the worker and all processes that it started. */
void worker_signal(pid_t pid, int signal_number);

#endif
