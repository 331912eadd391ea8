#include "optimizer/worker/worker_launcher.h"

#include "base/files/file_tree.h"
#include "base/status.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/worker_team.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { PATH_BYTES_MOST = 4096, NUMBER_BYTES = 24, MAX_LOSSES = 3, STOP_AGAIN_MS = 500 };
enum { EXIT_NO_PROGRAM = 127, EXIT_FORBIDDEN = 128 + SIGSYS };

struct command {
    char agent[PATH_BYTES_MOST], own[PATH_BYTES_MOST], ranks[NUMBER_BYTES], threads[NUMBER_BYTES];
    char **argv;
};

static size_t n_processor(void)
{
    cpu_set_t set;
    return sched_getaffinity(0, sizeof set, &set) == 0 ? (size_t)CPU_COUNT(&set) : 1;
}

static void add(struct command *c, const char *text)
{
    size_t n = 0;
    while (c->argv[n] != NULL) n++;
    c->argv[n] = (char *)(uintptr_t)text;
}

/* The arguments of this program but "--ranks N". */
static void add_own(struct command *c, char **argv)
{
    for (size_t i = 1; argv[i] != NULL; i++) {
        if (strncmp(argv[i], "--ranks=", 8) == 0) continue;
        if (strcmp(argv[i], "--ranks") == 0 && argv[i + 1] != NULL)
            i++;
        else
            add(c, argv[i]);
    }
}

static status make_command(struct command *c, char **argv, size_t n_rank, size_t n_thread, struct error *err)
{
    static const char *const first[] = {"mpirun", "-q", "--bind-to", "none", "--oversubscribe", "-n"};
    size_t n = 0, each = n_processor() / n_rank;
    memset(c, 0, sizeof *c);
    status s = worker_team_program(c->agent, sizeof c->agent, err);
    ssize_t n_own = readlink("/proc/self/exe", c->own, sizeof c->own - 1);
    if (s == STATUS_OK && n_own <= 0) s = error_set_errno(err, "cannot find this program");
    if (s != STATUS_OK) return s;
    while (argv[n] != NULL) n++;
    c->argv = calloc(n + 16, sizeof *c->argv);
    if (c->argv == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start ranks: out of memory");
    snprintf(c->ranks, sizeof c->ranks, "%zu", n_rank);
    snprintf(c->threads, sizeof c->threads, "%zu", each > 0 ? each : 1);
    for (size_t i = 0; i < sizeof first / sizeof *first; i++) add(c, first[i]);
    add(c, c->ranks);
    add(c, c->agent);
    add(c, c->own);
    if (n_thread == 0) {
        add(c, "--threads");
        add(c, c->threads);
    }
    add_own(c, argv);
    return STATUS_OK;
}

/* In a process group of its own: a signal to the group of the launcher would make mpirun end the ranks at once, and
 * rank 0 could not store its state. */
static _Noreturn void become_mpirun(const struct command *c, pid_t parent, const sigset_t *mask)
{
    int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM); /* by which mpirun ends the ranks and removes its files; SIGKILL left those */
    signal(SIGUSR1, SIG_IGN);         /* until mpirun handles it */
    if (getppid() != parent) _exit(EXIT_NO_PROGRAM);
    if (nothing >= 0) dup2(nothing, STDIN_FILENO);
    if (geteuid() == 0) { /* a worker of a daemon that runs as root has no more rights than its parent */
        setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
        setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    }
    sigprocmask(SIG_SETMASK, mask, NULL);
    execvp(c->argv[0], c->argv);
    fprintf(stderr, "selvedge-worker: cannot execute '%s': %s\n", c->argv[0], strerror(errno));
    _exit(EXIT_NO_PROGRAM);
}

/* Runs mpirun once. mask: the signals that mpirun is to block. *stopped: the job was asked to end. mpirun passes
 * SIGUSR1 on to the ranks; one that it gets before it has started them is lost, so it gets more of them. */
static int run_once(const struct command *c, const sigset_t *awaited, const sigset_t *mask, bool *stopped)
{
    const struct timespec again = {.tv_nsec = STOP_AGAIN_MS * 1000000L};
    int how = 0;
    const pid_t self = getpid();
    pid_t pid = fork();
    if (pid == 0) become_mpirun(c, self, mask);
    while (pid > 0 && waitpid(pid, &how, WNOHANG) != pid) {
        int got = sigtimedwait(awaited, NULL, &again);
        if (got == SIGTERM || got == SIGINT) *stopped = true;
        if (*stopped) kill(pid, SIGUSR1);
    }
    if (pid < 0) return WORKER_FAILED;
    return WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how);
}

static bool is_of_worker(int code) { return code >= WORKER_SUCCEEDED && code <= WORKER_STALE; }

/* Runs mpirun until the job has ended, or is lost several times at the same place. The folder of the job grows as it
 * goes on. */
static int run_until_end(const struct command *c, const char *job_folder)
{
    char path[PATH_BYTES_MOST];
    sigset_t awaited, mask;
    bool stopped = false;
    int64_t work = -1;
    sigemptyset(&awaited);
    sigaddset(&awaited, SIGTERM);
    sigaddset(&awaited, SIGINT);
    sigaddset(&awaited, SIGCHLD);
    sigprocmask(SIG_BLOCK, &awaited, &mask);
    snprintf(path, sizeof path, "%s/%s", job_folder, JOB_FOLDER_WORK);
    for (int n_loss = 0;;) {
        int code = run_once(c, &awaited, &mask, &stopped);
        if (is_of_worker(code) || code == EXIT_NO_PROGRAM || code == EXIT_FORBIDDEN) return code;
        if (stopped) return WORKER_CANCELLED;
        int64_t now = disk_content_bytes(path);
        n_loss = now > work ? 1 : n_loss + 1;
        work = now;
        if (n_loss == MAX_LOSSES) {
            fprintf(stderr, "selvedge-worker: ranks are lost again and again; the job does not go on\n");
            return WORKER_LOST;
        }
        fprintf(stderr, "selvedge-worker: a rank is lost; the job goes on from its checkpoint\n");
        nanosleep(&(struct timespec){.tv_sec = 1}, NULL); /* the kernel ends the workers of ranks that were lost */
    }
}

/* Ends this process as the sandbox has ended a rank, so that whoever has started it sees that. */
static void end_as_forbidden(void)
{
    signal(SIGSYS, SIG_DFL);
    raise(SIGSYS);
}

static int launch(char **argv, const char *job_folder, size_t n_rank, size_t n_thread)
{
    struct command c;
    struct error err = {0};
    if (make_command(&c, argv, n_rank, n_thread, &err) != STATUS_OK) {
        fprintf(stderr, "selvedge-worker: %s\n", err.text);
        return WORKER_USAGE;
    }
    int code = run_until_end(&c, job_folder);
    free(c.argv);
    if (code == EXIT_FORBIDDEN) end_as_forbidden();
    return code == EXIT_NO_PROGRAM ? WORKER_USAGE : code;
}

int worker_ranks_start(char **argv, const char *job_folder, size_t n_rank, size_t n_thread)
{
    struct error err = {0};
    const bool started = worker_team_is_started();
    if (!started) return n_rank > 1 ? launch(argv, job_folder, n_rank, n_thread) : -1;
    worker_team_join(argv, &err);
    fprintf(stderr, "selvedge-worker: %s\n", err.text);
    return WORKER_USAGE;
}
