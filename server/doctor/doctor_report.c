#include "server/doctor/doctor_report.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdarg.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

void doctor_say(struct doctor *d, enum doctor_grade grade, const char *subject, const char *format, ...)
{
    static const char *const word[] = {[DOCTOR_OK] = "ok", [DOCTOR_NOTE] = "note", [DOCTOR_FAULT] = "FAULT"};
    va_list list;
    d->n[grade]++;
    fprintf(d->out, "%-6s %-12s ", word[grade], subject);
    va_start(list, format);
    vfprintf(d->out, format, list);
    va_end(list);
    fputc('\n', d->out);
}

static status read_to_end(int fd, char *text, size_t n_text)
{
    size_t n = 0;
    char rest[4096];
    for (;;) {
        ssize_t got = n + 1 < n_text ? read(fd, text + n, n_text - 1 - n) : read(fd, rest, sizeof rest);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        if (n + 1 < n_text) n += (size_t)got;
    }
    text[n] = '\0';
    return STATUS_OK;
}

status doctor_execute(char *const *argv, char *text, size_t n_text, int *code, struct error *err)
{
    int end[2], how = 0;
    pid_t pid;
    posix_spawn_file_actions_t actions;
    if (pipe2(end, O_CLOEXEC) != 0) return error_set_errno(err, "cannot start '%s'", argv[0]);
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, end[1], STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, end[1], STDERR_FILENO);
    int failed = posix_spawnp(&pid, argv[0], &actions, NULL, argv, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(end[1]);
    if (failed == 0) read_to_end(end[0], text, n_text);
    close(end[0]);
    errno = failed;
    if (failed != 0) return error_set_errno(err, "cannot start '%s'", argv[0]);
    while (waitpid(pid, &how, 0) < 0 && errno == EINTR) continue;
    *code = WIFSIGNALED(how) ? 128 + WTERMSIG(how) : WEXITSTATUS(how);
    return STATUS_OK;
}
