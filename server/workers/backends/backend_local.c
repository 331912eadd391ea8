/* Workers as child processes of the daemon, on its machine. */
#include "server/settings/job_paths.h"
#include "server/workers/backends/job_backend.h"

#include <signal.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>

enum { LOOK_MS = 100 };

struct local {
    struct job_service *v;
    const char *program;
};

struct backend_run {
    pid_t pid;
    int pid_fd; /* becomes readable when the process ends; -1: the kernel has none */
    bool ended; /* so its id may belong to another process */
    struct worker_end end;
};

static status open_local(struct job_service *v, const char *program, void **state, struct error *err)
{
    if (access(program, X_OK) != 0) return error_set_errno(err, "cannot execute worker program '%s'", program);
    struct local *l = malloc(sizeof *l);
    if (l == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start workers: out of memory");
    *l = (struct local){v, program};
    *state = l;
    return STATUS_OK;
}

static bool ready(void *state) { return state != NULL; }

static status start(void *state, const char *job_id, struct backend_run **out, struct error *err)
{
    const struct local *l = state;
    char folder[PATH_BYTES], console[PATH_BYTES], speeds[PATH_BYTES];
    path_join(folder, l->v->settings->data, "jobs", job_id, NULL);
    path_join(console, folder, "console.txt", NULL);
    path_join(speeds, l->v->settings->data, "speeds.json", NULL);
    const struct worker_paths paths = {.program = l->program,
                                       .job_folder = folder,
                                       .console = console,
                                       .speeds = speeds,
                                       .ranks = l->v->settings->ranks};
    struct backend_run *run = calloc(1, sizeof *run);
    if (run == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start a worker: out of memory");
    status s = worker_launch(&paths, l->v->settings, &run->pid, err);
    if (s != STATUS_OK) {
        free(run);
        return s;
    }
    run->pid_fd = (int)syscall(SYS_pidfd_open, run->pid, 0);
    log_info(l->v->log, "job %s: worker %d started", job_id, (int)run->pid);
    *out = run;
    return STATUS_OK;
}

static enum backend_phase look(void *state, struct backend_run *run, struct worker_end *end)
{
    (void)state;
    if (!run->ended) run->ended = worker_ended(run->pid, &run->end);
    *end = run->end;
    return run->ended ? BACKEND_ENDED : BACKEND_RUNS;
}

static void stop(void *state, struct backend_run *run, bool at_once)
{
    (void)state;
    if (!run->ended) worker_signal(run->pid, at_once ? SIGKILL : SIGTERM);
}

static int64_t memory_bytes(const struct backend_run *run) { return run->ended ? 0 : worker_memory_bytes(run->pid); }

static int64_t thread_count(const struct backend_run *run) { return run->ended ? 0 : worker_thread_count(run->pid); }

static int end_fd(const struct backend_run *run) { return run->ended ? -1 : run->pid_fd; }

static void release(void *state, struct backend_run *run)
{
    (void)state;
    if (run->pid_fd >= 0) close(run->pid_fd);
    free(run);
}

const struct job_backend backend_local = {.name = "local",
                                          .look_ms = LOOK_MS,
                                          .open = open_local,
                                          .close = free,
                                          .ready = ready,
                                          .start = start,
                                          .look = look,
                                          .stop = stop,
                                          .memory_bytes = memory_bytes,
                                          .thread_count = thread_count,
                                          .end_fd = end_fd,
                                          .release = release};
