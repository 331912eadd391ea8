#include "optimizer/worker/report/page/report_pdf.h"

#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static const char program[] = "weasyprint";
enum { EXIT_NO_PROGRAM = 127, WAIT_MS = 50, LONGEST_S = 300 };

/* Whether a folder of PATH has the program. */
static bool installed(void)
{
    const char *from = getenv("PATH");
    while (from != NULL && *from != '\0') {
        char path[WORKER_PATH_BYTES];
        int n = (int)strcspn(from, ":");
        int length = snprintf(path, sizeof path, "%.*s/%s", n, from, program);
        if (n > 0 && length < (int)sizeof path && access(path, X_OK) == 0) return true;
        from += n + (from[n] == ':');
    }
    return false;
}

void report_pdf_warn(const struct pipeline_context *c)
{
    if (!c->doc->export_pdf || installed()) return;
    worker_status_warn(c->status, "report.pdf was not made: this machine has no program '%s' (Debian package %s)",
                       program, program);
}

static void become_program(const char *from, const char *to)
{
    int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (nothing < 0 || dup2(nothing, 0) < 0 || dup2(nothing, 1) < 0 || dup2(nothing, 2) < 0) _exit(EXIT_NO_PROGRAM);
    execlp(program, program, "--quiet", from, to, (char *)NULL);
    _exit(EXIT_NO_PROGRAM);
}

/* Waits for the end of the child. One that takes too long, or a cancelled job, is ended. */
static bool wait_for(const struct pipeline_context *c, pid_t child)
{
    const struct timespec pause = {0, WAIT_MS * 1000000L};
    for (int waited_ms = 0, how = 0;; waited_ms += WAIT_MS) {
        pid_t got = waitpid(child, &how, WNOHANG);
        if (got == child) return WIFEXITED(how) && WEXITSTATUS(how) == 0;
        if (got < 0 && errno != EINTR) return false;
        if (waited_ms > LONGEST_S * 1000 || progress_cancelled(&c->progress)) kill(child, SIGKILL);
        nanosleep(&pause, NULL);
    }
}

status report_pdf_write(struct pipeline_context *c, struct error *err)
{
    char from[WORKER_PATH_BYTES], part[WORKER_PATH_BYTES], to[WORKER_PATH_BYTES];
    if (!c->doc->export_pdf || !installed()) return STATUS_OK;
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, "report.html", from);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, ".part-report.pdf", part);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, "report.pdf", to);
    pid_t child = fork();
    if (child == 0) become_program(from, part);
    if (child > 0 && wait_for(c, child)) {
        status s = worker_folder_check(c->folder, err);
        return s == STATUS_OK ? durable_rename(part, to, err) : s;
    }
    unlink(part);
    if (progress_cancelled(&c->progress)) return error_set(err, STATUS_CANCELLED, "cancelled while making report.pdf");
    worker_status_warn(c->status, "report.pdf was not made: the program '%s' failed", program);
    return STATUS_OK;
}
