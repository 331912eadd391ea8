#include "server/workers/backends/slurm_command.h"
#include "base/clock.h"
#include "server/settings/job_paths.h"
#include "server/workers/backends/worker_process.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum { LONGEST_S = 60, STOPPING_S = 3, LOOK_MS = 200, MOST_BYTES = 16 << 20, STEP_BYTES = 16384, END_LOOK_US = 5000 };

/* The ends of the pipes that the daemon holds; -1: closed. */
struct pipes {
    int in, out, error;
};

struct text {
    char *bytes;
    size_t n;
};

status slurm_command_find(const struct settings *settings, const char *name, char *path, size_t n_path,
                          struct error *err)
{
    if (settings->slurm_commands[0] != '\0') {
        snprintf(path, n_path, "%s/%s", settings->slurm_commands, name);
        if (access(path, X_OK) == 0) return STATUS_OK;
        return error_set_field(err, STATUS_NOT_FOUND, "slurm.commands",
                               "there is no program '%s', which jobs.backend = slurm needs", path);
    }
    const char *from = getenv("PATH");
    for (const char *at = from == NULL ? "" : from; *at != '\0'; at += *at == ':') {
        size_t n = strcspn(at, ":");
        snprintf(path, n_path, "%.*s/%s", (int)n, at, name);
        if (n > 0 && access(path, X_OK) == 0) return STATUS_OK;
        at += n;
    }
    return error_set_field(err, STATUS_NOT_FOUND, "slurm.commands",
                           "there is no program '%s' in PATH, which jobs.backend = slurm needs: install Slurm's "
                           "commands (the Debian package slurm-client), or set slurm.commands to their folder",
                           name);
}

static void shut(int *fd)
{
    if (*fd >= 0) close(*fd);
    *fd = -1;
}

static status spawn(const struct settings *settings, const char *const *argument, struct pipes *p, pid_t *pid,
                    struct error *err)
{
    int end[3][2] = {{-1, -1}, {-1, -1}, {-1, -1}}; /* read and write end of each stream of the command */
    char *variable[WORKER_MAX_VARIABLE + 1];
    posix_spawn_file_actions_t action;
    posix_spawnattr_t attribute;
    sigset_t none, all;
    int e = 0;
    for (int i = 0; i < 3 && e == 0; i++) e = pipe2(end[i], O_CLOEXEC) != 0 ? errno : 0;
    sigemptyset(&none);
    sigfillset(&all);
    worker_environment(settings, "SLURM_CONF", variable);
    posix_spawn_file_actions_init(&action);
    posix_spawnattr_init(&attribute);
    for (int i = 0; i < 3; i++) posix_spawn_file_actions_adddup2(&action, end[i][i == 0 ? 0 : 1], i);
    posix_spawn_file_actions_addclosefrom_np(&action, 3);
    posix_spawnattr_setsigmask(&attribute, &none);
    posix_spawnattr_setsigdefault(&attribute, &all);
    posix_spawnattr_setflags(&attribute, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID);
    if (e == 0) e = posix_spawn(pid, argument[0], &action, &attribute, (char *const *)(uintptr_t)argument, variable);
    posix_spawn_file_actions_destroy(&action);
    posix_spawnattr_destroy(&attribute);
    for (int i = 0; i < 3; i++) shut(&end[i][i == 0 ? 0 : 1]);
    *p = (struct pipes){.in = end[0][1], .out = end[1][0], .error = end[2][0]};
    if (e == 0) return STATUS_OK;
    shut(&p->in);
    shut(&p->out);
    shut(&p->error);
    errno = e;
    return error_set_errno(err, "cannot run '%s'", argument[0]);
}

/* Reads the available bytes. Closes the descriptor at its end, when memory is out, or when there is too much. */
static void take(int *fd, struct text *t)
{
    char *more = t->n < MOST_BYTES ? realloc(t->bytes, t->n + STEP_BYTES + 1) : NULL;
    if (more != NULL) t->bytes = more;
    ssize_t k = more == NULL ? 0 : read(*fd, t->bytes + t->n, STEP_BYTES);
    if (k > 0) t->n += (size_t)k;
    if (k == 0 || (k < 0 && errno != EINTR)) shut(fd);
}

static void give(int *fd, const char **input)
{
    ssize_t k = write(*fd, *input, strlen(*input));
    if (k > 0) *input += k;
    if (**input == '\0' || (k < 0 && errno != EINTR)) shut(fd);
}

/* How long the daemon waits for a command. */
struct patience {
    double end_s;
    const atomic_bool *stop; /* NULL: it does not stop */
};

static double left_s(struct patience *w)
{
    const double now_s = clock_monotonic_s();
    if (w->stop != NULL && atomic_load(w->stop) && w->end_s > now_s + STOPPING_S) w->end_s = now_s + STOPPING_S;
    return w->end_s - now_s;
}

/* Feeds the command and reads from it until it has closed its outputs. Returns false when it takes too long. */
static bool converse(struct pipes *p, const char *input, struct patience *w, struct text *out, struct text *error)
{
    if (input == NULL || *input == '\0') shut(&p->in);
    while (p->out >= 0 || p->error >= 0) {
        struct pollfd fd[3] = {{p->out, POLLIN, 0}, {p->error, POLLIN, 0}, {p->in, POLLOUT, 0}};
        if (left_s(w) <= 0) return false;
        if (poll(fd, 3, LOOK_MS) < 0 && errno != EINTR) return false;
        if (fd[0].revents != 0) take(&p->out, out);
        if (fd[1].revents != 0) take(&p->error, error);
        if (fd[2].revents != 0) give(&p->in, &input);
    }
    return true;
}

static int wait_for(pid_t pid, struct patience *w)
{
    int state = 0;
    while (left_s(w) > 0) {
        pid_t got = waitpid(pid, &state, WNOHANG);
        if (got == pid) return WIFEXITED(state) ? WEXITSTATUS(state) : -1;
        if (got < 0 && errno != EINTR) return -1;
        usleep(END_LOOK_US);
    }
    kill(-pid, SIGKILL);
    while (waitpid(pid, &state, 0) < 0 && errno == EINTR) continue;
    return -1;
}

/* Copies text as one line of printable ASCII: lines are joined by "; ". */
static void one_line(const struct text *t, char *out, size_t n_out)
{
    size_t k = 0;
    for (size_t i = 0; i < t->n && k + 3 < n_out; i++) {
        unsigned char c = (unsigned char)t->bytes[i];
        if (c == '\n' && i + 1 < t->n) out[k++] = ';';
        if (c == '\n' && i + 1 == t->n) continue;
        out[k++] = (char)(c < 32 || c > 126 ? ' ' : c);
    }
    out[k] = '\0';
}

/* Appends words to the words of the command. They replace its last ones where there is no room. */
static void add_words(char *text, size_t n_text, const char *words)
{
    const size_t n_words = strlen(words) + 3, n = strlen(text), most = n_text - n_words;
    snprintf(text + (n < most ? n : most), n_words, "%s%s", n > 0 ? "; " : "", words);
}

status slurm_command_run(const struct settings *settings, const char *const *argument, const char *input,
                         const atomic_bool *stop, struct slurm_output *out, struct error *err)
{
    struct pipes p;
    struct text text = {0}, error = {0};
    pid_t pid;
    *out = (struct slurm_output){.code = -1};
    status s = spawn(settings, argument, &p, &pid, err);
    if (s != STATUS_OK) return s;
    struct patience patience = {clock_monotonic_s() + LONGEST_S, stop};
    bool in_time = converse(&p, input, &patience, &text, &error);
    shut(&p.in);
    shut(&p.out);
    shut(&p.error);
    if (!in_time) patience.end_s = 0;
    out->code = wait_for(pid, &patience);
    one_line(&error, out->error, sizeof out->error);
    if (!in_time) add_words(out->error, sizeof out->error, "the command gave no answer in time and was ended");
    free(error.bytes);
    out->text = text.bytes != NULL ? text.bytes : calloc(1, 1);
    if (out->text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot run '%s': out of memory", argument[0]);
    out->text[text.n] = '\0';
    return STATUS_OK;
}
