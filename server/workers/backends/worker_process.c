#include "server/workers/backends/worker_process.h"
#include "base/files/foreign_file.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { EXIT_CANNOT_EXECUTE = 127, NUMBER_BYTES = 24 };

/* The values that the new process needs between vfork and exec. */
struct start {
    const char *program;
    char *const *argv, *const *environment;
    int output_fd, error_fd, null_fd;
    const struct settings *settings;
    char oom_score_adj[NUMBER_BYTES];
    pid_t parent;
};

static void set_limit(__rlimit_resource_t resource, int64_t value)
{
    struct rlimit limit;
    if (getrlimit(resource, &limit) != 0) return;
    if (limit.rlim_max > (rlim_t)value) limit.rlim_max = (rlim_t)value; /* it cannot be raised */
    limit.rlim_cur = limit.rlim_max;
    setrlimit(resource, &limit);
}

/* The kernel counts the threads of all processes of a user (but of root's none), so this limit covers all workers
 * together and the daemon. The supervisor counts the threads of each worker; until it looks, a worker must not take all
 * threads of the machine. */
static int64_t most_processes(const struct settings *s)
{
    enum { OF_THE_USER = 4096 };
    return OF_THE_USER + s->max_connections + 2 * s->workers * s->thread_limit;
}

static void set_limits(const struct start *s)
{
    setpriority(PRIO_PROCESS, 0, (int)s->settings->nice);
    set_limit(RLIMIT_CORE, 0);
    set_limit(RLIMIT_NOFILE, s->settings->open_files);
    if (s->settings->thread_limit > 0) set_limit(RLIMIT_NPROC, most_processes(s->settings));
    if (s->settings->file_limit_bytes > 0) set_limit(RLIMIT_FSIZE, s->settings->file_limit_bytes);
    if (s->settings->memory_limit_bytes > 0) set_limit(RLIMIT_AS, s->settings->memory_limit_bytes);
    int fd = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (fd >= 0 && write(fd, s->oom_score_adj, strlen(s->oom_score_adj)) < 0) {
        /* a container may forbid it */
    }
    if (fd >= 0) close(fd);
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
}

/* Runs in the memory of the daemon, whose calling thread waits, so it makes only system calls and changes no variable
 * of the daemon's. */
static _Noreturn void become_worker(const struct start *s)
{
    setsid();
    if (dup2(s->null_fd, 0) < 0 || dup2(s->output_fd, 1) < 0 || dup2(s->error_fd, 2) < 0) _exit(EXIT_CANNOT_EXECUTE);
    if (close_range(3, ~0U, 0) != 0) _exit(EXIT_CANNOT_EXECUTE);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != s->parent) _exit(EXIT_CANNOT_EXECUTE);
    set_limits(s);
    sigset_t empty;
    sigemptyset(&empty);
    for (int i = 1; i < NSIG; i++) signal(i, SIG_DFL);
    sigprocmask(SIG_SETMASK, &empty, NULL);
    execve(s->program, s->argv, s->environment);
    static const char text[] = "the worker program cannot be executed\n";
    ssize_t n = write(2, text, sizeof text - 1);
    _exit(n < 0 ? EXIT_CANNOT_EXECUTE : EXIT_CANNOT_EXECUTE);
}

static pid_t start(const struct start *s)
{
    pid_t pid = vfork();
    if (pid == 0) become_worker(s);
    return pid;
}

/* Adds the variables whose names are listed to n others. Returns the new number. */
static size_t choose_variables(const char *names, char *variable[WORKER_MAX_VARIABLE + 1], size_t n)
{
    for (const char *at = names; *at != '\0' && n < WORKER_MAX_VARIABLE;) {
        size_t length = strcspn(at, " ,");
        for (char **e = environ; length > 0 && *e != NULL; e++)
            if (strncmp(*e, at, length) == 0 && (*e)[length] == '=') {
                variable[n++] = *e;
                break; /* a name that is there twice counts once */
            }
        at += length + (at[length] != '\0');
    }
    variable[n] = NULL;
    return n;
}

void worker_environment(const struct settings *settings, const char *one_more, char *variable[WORKER_MAX_VARIABLE + 1])
{
    size_t n = choose_variables(settings->pass_environment, variable, 0);
    choose_variables(one_more, variable, n);
}

static void add(struct worker_arguments *a, const char *text)
{
    size_t n = 0;
    while (a->argument[n] != NULL) n++;
    a->argument[n] = text;
}

void worker_arguments_set(struct worker_arguments *a, const struct worker_paths *p, const struct settings *s)
{
    const int64_t threads = p->threads > 0 ? p->threads : s->threads;
    *a = (struct worker_arguments){.argument = {NULL}};
    snprintf(a->memory_mib, NUMBER_BYTES, "%lld", (long long)(s->volume_memory_bytes >> 20));
    snprintf(a->scratch_mib, NUMBER_BYTES, "%lld", (long long)((s->scratch_limit_bytes >> 20) + 1));
    snprintf(a->threads, NUMBER_BYTES, "%lld", (long long)threads);
    const char *const always[] = {p->program, "--memory-mib", a->memory_mib, "--sandbox", s->sandbox};
    for (size_t i = 0; i < sizeof always / sizeof *always; i++) add(a, always[i]);
    add(a, p->document != NULL ? "--check" : "--speeds");
    add(a, p->document != NULL ? p->document : p->speeds);
    if (p->plan) add(a, "--plan");
    if (p->pictures) add(a, "--pictures");
    if (p->document != NULL || p->plan) add(a, "--no-links");
    if (threads > 0) {
        add(a, "--threads");
        add(a, a->threads);
    }
    if (p->ranks > 1 && p->document == NULL) {
        snprintf(a->ranks, NUMBER_BYTES, "%lld", (long long)p->ranks);
        add(a, "--ranks");
        add(a, a->ranks);
    }
    if (s->scratch_limit_bytes > 0) {
        add(a, "--scratch-mib");
        add(a, a->scratch_mib);
    }
    add(a, p->job_folder);
}

/* Of an earlier attempt, which may have put a pipe there. Its folder is left, and the start fails. */
static int open_console(const char *path)
{
    struct stat st;
    if (lstat(path, &st) == 0 && !S_ISDIR(st.st_mode) && foreign_file_clear(path, NULL) != STATUS_OK) return -1;
    return open(path, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600);
}

status worker_launch(const struct worker_paths *paths, const struct settings *settings, pid_t *out, struct error *err)
{
    char *variable[WORKER_MAX_VARIABLE + 1];
    struct worker_arguments a;
    status s = STATUS_OK;
    worker_environment(settings, "", variable);
    worker_arguments_set(&a, paths, settings);
    struct start new = {.program = paths->program,
                        .argv = (char *const *)(uintptr_t)a.argument,
                        .environment = variable,
                        .settings = settings,
                        .output_fd = paths->report_fd,
                        .error_fd = -1,
                        .null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC),
                        .parent = getpid()};
    snprintf(new.oom_score_adj, NUMBER_BYTES, "%lld", (long long)settings->oom_score_adj);
    if (new.null_fd < 0) return error_set_errno(err, "cannot open '/dev/null'");
    const bool reports = paths->document != NULL || paths->plan;
    if (reports)
        new.error_fd = open("/dev/null", O_WRONLY | O_CLOEXEC);
    else
        new.output_fd = new.error_fd = open_console(paths->console);
    if (new.error_fd < 0)
        s = error_set_errno(err, "cannot write '%s'", reports ? "/dev/null" : paths->console);
    else if ((*out = start(&new)) < 0)
        s = error_set_errno(err, "cannot start worker '%s'", paths->program);
    if (new.error_fd >= 0) close(new.error_fd);
    close(new.null_fd);
    return s;
}

bool worker_ended(pid_t pid, struct worker_end *end)
{
    int state;
    struct rusage usage;
    pid_t got = wait4(pid, &state, WNOHANG, &usage);
    if (got == 0 || (got < 0 && errno == EINTR)) return false;
    *end = (struct worker_end){0};
    if (got < 0) { /* no longer our child, so nothing is known of it */
        end->by_signal = true;
        end->code = SIGKILL;
        return true;
    }
    end->by_signal = WIFSIGNALED(state);
    end->code = end->by_signal ? WTERMSIG(state) : WEXITSTATUS(state);
    end->peak_rss_bytes = (int64_t)usage.ru_maxrss * 1024;
    if (end->by_signal || end->code != 0) kill(-pid, SIGKILL); /* processes that it may have left in its group */
    return true;
}

/* Adds up lines of /proc/PID/status by the beginnings that end with NULL. */
static int64_t status_sum(pid_t pid, const char *const *part)
{
    char path[NUMBER_BYTES + 16], line[128];
    long long sum = 0;
    snprintf(path, sizeof path, "/proc/%d/status", (int)pid);
    FILE *f = fopen(path, "re");
    if (f == NULL) return 0;
    while (fgets(line, sizeof line, f) != NULL)
        for (size_t i = 0; part[i] != NULL; i++)
            if (strncmp(line, part[i], strlen(part[i])) == 0) sum += strtoll(line + strlen(part[i]), NULL, 10);
    fclose(f);
    return sum;
}

int64_t worker_memory_bytes(pid_t pid)
{
    static const char *const part[] = {"RssAnon:", "RssShmem:", "VmSwap:", NULL};
    return 1024 * status_sum(pid, part);
}

int64_t worker_thread_count(pid_t pid)
{
    static const char *const part[] = {"Threads:", NULL};
    return status_sum(pid, part);
}

void worker_signal(pid_t pid, int signal_number)
{
    if (kill(-pid, signal_number) != 0) kill(pid, signal_number);
}
