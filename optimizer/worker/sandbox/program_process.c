#include "optimizer/worker/sandbox/program_process.h"
#include "base/files/durable.h"
#include "base/process.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_outline.h"
#include "optimizer/report/export/blend_file.h"
#include "optimizer/report/report_pdf.h"
#include "optimizer/worker/sandbox/sandbox_calls.h"
#include "optimizer/worker/sandbox/sandbox_files.h"

#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

enum { EXIT_NO_PROGRAM = 127, ORDER_FD = 3 };

/* The folder of Python's settings for the whole machine, as "/etc/python3.11". */
static void python_settings(char path[WORKER_PATH_BYTES])
{
    char program_path[PATH_MAX];
    const char *name = realpath("/usr/bin/python3", program_path) != NULL ? strrchr(program_path, '/') : "/python3";
    snprintf(path, WORKER_PATH_BYTES, "/etc%.100s", name);
}

/* The program sees its own files, fonts and the job's results, where it writes its file, and has no network. Where the
 * kernel lacks a part of the sandbox it does without, as the worker does. */
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

/* Python, which both programs contain, looks for its files beside the first Python of PATH. */
static void set_environment(const char *program, const char *work)
{
    char folder[PATH_MAX], path[PATH_MAX + 20];
    if (program_find(program, folder, sizeof folder)) {
        snprintf(path, sizeof path, "%s:/usr/bin:/bin", folder);
        setenv("PATH", path, 1);
    }
    setenv("TMPDIR", work, 1);
    setenv("HOME", work, 1);
}

static _Noreturn void be_helper(const struct worker_folder *folder, const char *prefix, const char *const *command,
                                int order_fd)
{
    char results[WORKER_PATH_BYTES], work[WORKER_PATH_BYTES], go;
    int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (nothing < 0 || dup2(nothing, 0) < 0 || dup2(nothing, 1) < 0 || dup2(nothing, 2) < 0) _exit(EXIT_NO_PROGRAM);
    if (dup2(order_fd, ORDER_FD) < 0 || close_range(ORDER_FD + 1, ~0U, 0) != 0) _exit(EXIT_NO_PROGRAM);
    worker_folder_path(folder, JOB_FOLDER_RESULTS, NULL, results);
    worker_folder_path(folder, JOB_FOLDER_WORK, NULL, work);
    restrict_helper(prefix, results, work);
    if (read(ORDER_FD, &go, 1) != 1) _exit(0); /* the worker has ended */
    close(ORDER_FD);
    set_environment(command[0], work);
    execvp(command[0], (char **)(uintptr_t)command);
    _exit(EXIT_NO_PROGRAM);
}

static void start(const struct worker_folder *folder, const char *prefix, const char *const *command,
                  struct program_helper *helper)
{
    int end[2];
    if (pipe2(end, O_CLOEXEC) != 0) return;
    pid_t pid = fork();
    if (pid == 0) be_helper(folder, prefix, command, end[0]);
    close(end[0]);
    if (pid < 0 || fcntl(end[1], F_SETFD, 0) != 0) {
        close(end[1]);
        return;
    }
    *helper = (struct program_helper){.pid = pid, .order_fd = end[1]};
}

void program_processes_start(const struct worker_folder *folder, const struct job_outline *outline,
                             struct program_helpers *helper)
{
    char prefix[WORKER_PATH_BYTES];
    *helper = program_helpers_none();
    /* folders that do not exist yet cannot be permitted to a helper */
    for (size_t i = 0; i < 2 && (outline->export_pdf || outline->export_blend); i++) {
        char own[WORKER_PATH_BYTES];
        worker_folder_path(folder, i == 0 ? JOB_FOLDER_RESULTS : JOB_FOLDER_WORK, NULL, own);
        durable_make_folder(own, NULL);
    }
    if (outline->export_pdf && report_pdf_installed(prefix)) {
        struct pdf_paths path;
        report_pdf_paths(folder, &path);
        const char *const command[] = {JOB_PDF_PROGRAM, "--quiet", path.from, path.part, NULL};
        start(folder, prefix, command, &helper->pdf);
    }
    if (outline->export_blend && blend_file_possible(prefix)) {
        struct blend_paths path;
        blend_file_paths(folder, &path);
        const char *const command[] = {JOB_BLEND_PROGRAM,
                                       "-b",
                                       "--factory-startup",
                                       "--python-exit-code",
                                       "1",
                                       "--python",
                                       path.script,
                                       "--",
                                       "--save",
                                       path.part,
                                       NULL};
        start(folder, prefix, command, &helper->blend);
    }
}
