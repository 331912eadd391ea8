/* A worker process: it has its own session, a lower priority and limited memory. The kernel kills it when the daemon
 * dies (PR_SET_PDEATHSIG), so after a crash of the daemon no worker is left that could write beside a new one. */
#ifndef SELVEDGE_SERVER_WORKER_PROCESS_H
#define SELVEDGE_SERVER_WORKER_PROCESS_H

#include "base/status.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

struct worker_limits {
    int nice;
    int64_t memory_bytes;        /* address space; 0: no limit */
    int64_t volume_memory_bytes; /* passed to the worker as --memory-mib */
    const char *speeds_path;     /* passed to the worker as --speeds */
};

struct worker_end {
    bool by_signal;
    int code; /* exit code or signal number */
    int64_t peak_rss_bytes;
};

/* Starts a worker. stdout and stderr go to console_path, which is made new. To be called from a thread that lives as
 * long as the daemon. STATUS_IO, STATUS_NO_MEMORY. */
status worker_launch(const char *program, const char *job_folder, const char *console_path,
                     const struct worker_limits *limits, pid_t *pid, struct error *err);
/* Returns false while the worker runs. */
bool worker_ended(pid_t pid, struct worker_end *end);
/* Sends a signal to the worker and all processes that it started. */
void worker_signal(pid_t pid, int signal_number);

#endif
