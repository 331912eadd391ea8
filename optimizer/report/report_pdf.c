#include "optimizer/report/report_pdf.h"

#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/sandbox/sandbox_calls.h"
#include "optimizer/worker/sandbox/sandbox_files.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char program[] = "weasyprint";
enum { EXIT_NO_PROGRAM = 127, WAIT_MS = 50, LONGEST_S = 300, ORDER_FD = 3 };

/* Finds the program in the folders of PATH; writes the folder above that folder, which has the program's files. */
static bool installed(char prefix[WORKER_PATH_BYTES])
{
    const char *from = getenv("PATH");
    while (from != NULL && *from != '\0') {
        char path[WORKER_PATH_BYTES];
        int n = (int)strcspn(from, ":");
        int length = snprintf(path, sizeof path, "%.*s/%s", n, from, program);
        if (n > 0 && length < (int)sizeof path && access(path, X_OK) == 0) {
            char up[WORKER_PATH_BYTES], whole[PATH_MAX];
            snprintf(up, sizeof up, "%.*s/..", n, from);
            /* from a /bin of its own it needs no more than what every program does */
            bool all = realpath(up, whole) == NULL || strcmp(whole, "/") == 0;
            snprintf(prefix, WORKER_PATH_BYTES, "%s", all ? "/usr" : up);
            return true;
        }
        from += n + (from[n] == ':');
    }
    return false;
}

void report_pdf_warn(const struct report *report)
{
    char prefix[WORKER_PATH_BYTES];
    if (!report->in.results->export_pdf || installed(prefix)) return;
    worker_status_warn(report->in.job->tools->status,
                       "report.pdf was not made: this machine has no program '%s' (Debian package %s)", program,
                       program);
}

/* The files of the page, in the helper and in the worker. */
struct pdf_paths {
    char from[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES];
};

static void set_paths(const struct worker_folder *folder, struct pdf_paths *p)
{
    worker_folder_path(folder, JOB_FOLDER_RESULTS, "report.html", p->from);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, ".part-report.pdf", p->part);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, "report.pdf", p->to);
}

/* The folder of Python's settings for the whole machine, as "/etc/python3.11". */
static void python_settings(char path[WORKER_PATH_BYTES])
{
    char program_path[PATH_MAX];
    const char *name = realpath("/usr/bin/python3", program_path) != NULL ? strrchr(program_path, '/') : "/python3";
    snprintf(path, WORKER_PATH_BYTES, "/etc%.100s", name);
}

/* WeasyPrint sees its own files, fonts and the page; it writes the PDF, and has no network. Where the kernel lacks a
 * part of the sandbox it does without, as the worker does. */
static void restrict_helper(const char *prefix, const char *results, const char *work)
{
    int version;
    bool calls;
    char versioned[WORKER_PATH_BYTES];
    python_settings(versioned);
    const struct sandbox_path path[] = {{SANDBOX_EXECUTE, "/usr"},
                                        {SANDBOX_EXECUTE, "/bin"},
                                        {SANDBOX_EXECUTE, "/lib"},
                                        {SANDBOX_EXECUTE, "/lib64"},
                                        {SANDBOX_EXECUTE, prefix},
                                        {SANDBOX_READ, "/etc/fonts"},
                                        {SANDBOX_READ, "/etc/ld.so.cache"},
                                        {SANDBOX_READ, "/etc/localtime"},
                                        {SANDBOX_READ, "/etc/mime.types"},
                                        {SANDBOX_READ, "/etc/python3"},
                                        {SANDBOX_READ, versioned},
                                        {SANDBOX_READ, "/var/cache/fontconfig"},
                                        {SANDBOX_READ, "/proc/self/status"},
                                        {SANDBOX_READ, "/proc/self/maps"},
                                        {SANDBOX_READ, "/dev/urandom"},
                                        {SANDBOX_OVERWRITE, "/dev/null"},
                                        {SANDBOX_OWN, results},
                                        {SANDBOX_OWN, work}};
    sandbox_files_restrict(path, sizeof path / sizeof *path, &version, NULL);
    sandbox_calls_of_program(&calls, NULL);
}

static _Noreturn void be_helper(const struct worker_folder *folder, const char *prefix, int order_fd)
{
    char results[WORKER_PATH_BYTES], work[WORKER_PATH_BYTES], go;
    struct pdf_paths path;
    int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (nothing < 0 || dup2(nothing, 0) < 0 || dup2(nothing, 1) < 0 || dup2(nothing, 2) < 0) _exit(EXIT_NO_PROGRAM);
    if (dup2(order_fd, ORDER_FD) < 0 || close_range(ORDER_FD + 1, ~0U, 0) != 0) _exit(EXIT_NO_PROGRAM);
    set_paths(folder, &path);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, NULL, results);
    worker_folder_path(folder, JOB_FOLDER_WORK, NULL, work);
    restrict_helper(prefix, results, work);
    if (read(ORDER_FD, &go, 1) != 1) _exit(0); /* the worker has ended */
    close(ORDER_FD);
    setenv("TMPDIR", work, 1);
    execlp(program, program, "--quiet", path.from, path.part, (char *)NULL);
    _exit(EXIT_NO_PROGRAM);
}

void report_pdf_start_helper(const struct worker_folder *folder, struct pdf_helper *helper)
{
    char prefix[WORKER_PATH_BYTES];
    int end[2];
    *helper = (struct pdf_helper){.order_fd = -1};
    /* what does not exist yet cannot be permitted to the helper */
    for (size_t i = 0; i < 2; i++) {
        char own[WORKER_PATH_BYTES];
        worker_folder_path(folder, i == 0 ? JOB_FOLDER_RESULTS : JOB_FOLDER_WORK, NULL, own);
        durable_make_folder(own, NULL);
    }
    if (!installed(prefix) || pipe2(end, O_CLOEXEC) != 0) return;
    pid_t pid = fork();
    if (pid == 0) be_helper(folder, prefix, end[0]);
    close(end[0]);
    if (pid < 0 || fcntl(end[1], F_SETFD, 0) != 0) {
        close(end[1]);
        return;
    }
    *helper = (struct pdf_helper){.pid = pid, .order_fd = end[1]};
}

/* Waits for the end of the program. One that takes too long, or that of a cancelled job, ends with the worker. */
static bool wait_for(const struct report *report, pid_t child)
{
    const struct timespec pause = {0, WAIT_MS * 1000000L};
    for (int waited_ms = 0, how = 0; waited_ms < LONGEST_S * 1000; waited_ms += WAIT_MS) {
        pid_t got = waitpid(child, &how, WNOHANG);
        if (got == child) return WIFEXITED(how) && WEXITSTATUS(how) == 0;
        if ((got < 0 && errno != EINTR) || progress_cancelled(&report->in.job->tools->progress)) return false;
        nanosleep(&pause, NULL);
    }
    return false;
}

status report_pdf_write(struct report *report, struct error *err)
{
    char prefix[WORKER_PATH_BYTES];
    struct pdf_paths path;
    if (!report->in.results->export_pdf || !installed(prefix)) return STATUS_OK;
    set_paths(report->in.job->tools->folder, &path);
    if (report->in.pdf.pid > 0 && write(report->in.pdf.order_fd, "g", 1) == 1 && wait_for(report, report->in.pdf.pid) &&
        access(path.part, F_OK) == 0) {
        status s = worker_folder_check(report->in.job->tools->folder, err);
        return s == STATUS_OK ? durable_rename(path.part, path.to, err) : s;
    }
    unlink(path.part);
    if (progress_cancelled(&report->in.job->tools->progress))
        return error_set(err, STATUS_CANCELLED, "cancelled while making report.pdf");
    worker_status_warn(report->in.job->tools->status, "report.pdf was not made: the program '%s' failed", program);
    return STATUS_OK;
}
