#include "server/workers/worker_process.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { EXIT_CANNOT_EXECUTE = 127 };

/* Runs between fork and exec of a threaded process, so it makes only system calls. */
static _Noreturn void become_worker(const char *program, char *const argv[], int console_fd, int null_fd,
                                    const struct worker_limits *limits, pid_t parent)
{
    setsid();
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(EXIT_CANNOT_EXECUTE);
    setpriority(PRIO_PROCESS, 0, limits->nice);
    struct rlimit none = {0, 0};
    setrlimit(RLIMIT_CORE, &none);
    if (limits->memory_bytes > 0) {
        struct rlimit memory = {(rlim_t)limits->memory_bytes, (rlim_t)limits->memory_bytes};
        setrlimit(RLIMIT_AS, &memory);
    }
    sigset_t empty;
    sigemptyset(&empty);
    for (int i = 1; i < NSIG; i++) signal(i, SIG_DFL);
    sigprocmask(SIG_SETMASK, &empty, NULL);
    if (dup2(null_fd, 0) < 0 || dup2(console_fd, 1) < 0 || dup2(console_fd, 2) < 0) _exit(EXIT_CANNOT_EXECUTE);
    execv(program, argv);
    static const char text[] = "the worker program cannot be executed\n";
    ssize_t n = write(2, text, sizeof text - 1);
    _exit(n < 0 ? EXIT_CANNOT_EXECUTE : EXIT_CANNOT_EXECUTE);
}

status worker_launch(const char *program, const char *job_folder, const char *console_path,
                     const struct worker_limits *limits, pid_t *out, struct error *err)
{
    status s = STATUS_OK;
    int null_fd = -1;
    int console_fd = open(console_path, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (console_fd < 0) return error_set_errno(err, "cannot write '%s'", console_path);
    null_fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (null_fd < 0) {
        s = error_set_errno(err, "cannot open '/dev/null'");
        goto out;
    }
    char volume_mib[24];
    snprintf(volume_mib, sizeof volume_mib, "%lld", (long long)(limits->volume_memory_bytes >> 20));
    char *folder = (char *)(uintptr_t)job_folder, *speeds = (char *)(uintptr_t)limits->speeds_path,
         *argv[] = {(char *)(uintptr_t)program, "--memory-mib", volume_mib, "--speeds", speeds, folder, NULL};
    pid_t parent = getpid(), pid = fork();
    if (pid < 0) s = error_set_errno(err, "cannot start worker '%s'", program);
    if (pid == 0) become_worker(program, argv, console_fd, null_fd, limits, parent);
    if (s == STATUS_OK) *out = pid;
out:
    if (null_fd >= 0) close(null_fd);
    close(console_fd);
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

void worker_signal(pid_t pid, int signal_number)
{
    if (kill(-pid, signal_number) != 0) kill(pid, signal_number);
}
