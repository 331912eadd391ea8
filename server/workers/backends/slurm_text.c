#include "server/workers/backends/slurm_text.h"
#include "optimizer/job/job_folder.h"

#include <ctype.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

enum { N_COLUMN = 6, N_ACCOUNT_COLUMN = 4, FIRST_SIGNAL_CODE = 128 };

/* The states of a Slurm job (squeue(1), "JOB STATE CODES"). Unknown ones count as running, so that a newer Slurm ends
 * no job by mistake; ended jobs leave the list after a while. */
static const struct {
    const char *state;
    enum backend_phase phase;
    enum worker_cause cause; /* with BACKEND_ENDED */
    const char *why;
} meaning[] = {
    {"PENDING", BACKEND_WAITS, 0, NULL},
    {"CONFIGURING", BACKEND_WAITS, 0, NULL},
    {"SUSPENDED", BACKEND_WAITS, 0, NULL},
    {"STOPPED", BACKEND_WAITS, 0, NULL},
    {"REQUEUED", BACKEND_WAITS, 0, NULL},
    {"REQUEUE_HOLD", BACKEND_WAITS, 0, NULL},
    {"REQUEUE_FED", BACKEND_WAITS, 0, NULL},
    {"RESV_DEL_HOLD", BACKEND_WAITS, 0, NULL},
    {"SPECIAL_EXIT", BACKEND_WAITS, 0, NULL},
    {"RUNNING", BACKEND_RUNS, 0, NULL},
    {"COMPLETING", BACKEND_RUNS, 0, NULL},
    {"RESIZING", BACKEND_RUNS, 0, NULL},
    {"SIGNALING", BACKEND_RUNS, 0, NULL},
    {"STAGE_OUT", BACKEND_RUNS, 0, NULL},
    {"COMPLETED", BACKEND_ENDED, WORKER_ENDED, NULL},
    {"FAILED", BACKEND_ENDED, WORKER_ENDED, NULL},
    {"CANCELLED", BACKEND_ENDED, WORKER_CANCELLED_OUTSIDE, "it was cancelled in Slurm"},
    {"PREEMPTED", BACKEND_ENDED, WORKER_INTERRUPTED, "Slurm has given its node to another job"},
    {"REVOKED", BACKEND_ENDED, WORKER_INTERRUPTED, "another cluster has taken the job"},
    {"TIMEOUT", BACKEND_ENDED, WORKER_OUT_OF_TIME, "Slurm ended it at its time limit (slurm.time_limit_s)"},
    {"DEADLINE", BACKEND_ENDED, WORKER_OUT_OF_TIME, "Slurm ended it at its deadline"},
    {"NODE_FAIL", BACKEND_ENDED, WORKER_NODE_LOST, "its node was lost"},
    {"BOOT_FAIL", BACKEND_ENDED, WORKER_NODE_LOST, "its node did not boot"},
    {"OUT_OF_MEMORY", BACKEND_ENDED, WORKER_OUT_OF_MEMORY, "it needed more memory than was asked for"},
};

bool slurm_parse_id(const char *text, char id[SLURM_ID_BYTES])
{
    size_t n = strspn(text, "0123456789");
    if (n == 0 || n >= SLURM_ID_BYTES || (text[n] != '\0' && text[n] != '\n' && text[n] != ';')) return false;
    snprintf(id, SLURM_ID_BYTES, "%.*s", (int)n, text);
    return true;
}

/* Copies a column, of n bytes. Slurm's words for an empty column become "". */
static void copy(char *out, size_t n_out, const char *from, size_t n)
{
    while (n > 0 && *from == ' ') from++, n--;
    while (n > 0 && from[n - 1] == ' ') n--;
    if ((n == 6 && strncmp(from, "(null)", n) == 0) || (n == 4 && strncmp(from, "None", n) == 0)) n = 0;
    snprintf(out, n_out, "%.*s", (int)n, from);
}

/* Splits a line at its separators. Returns the number of columns; further ones than `most` are counted alone. */
static size_t split(const char *line, size_t n_line, const char *column[], size_t n_column[], size_t most)
{
    size_t n = 0;
    for (const char *at = line, *end = line + n_line; at <= end;) {
        const char *bar = memchr(at, '|', (size_t)(end - at));
        if (n < most) column[n] = at;
        if (n < most) n_column[n] = (size_t)((bar != NULL ? bar : end) - at);
        n++;
        if (bar == NULL) break;
        at = bar + 1;
    }
    return n;
}

static bool read_job(const char *line, size_t n_line, struct slurm_job *job)
{
    const char *c[N_COLUMN];
    size_t n[N_COLUMN];
    char number[16];
    *job = (struct slurm_job){0};
    /* the line ends with a separator */
    if (split(line, n_line, c, n, N_COLUMN) != N_COLUMN + 1) return false;
    copy(job->id, sizeof job->id, c[0], n[0]);
    copy(job->state, sizeof job->state, c[1], n[1]);
    copy(number, sizeof number, c[2], n[2]);
    copy(job->reason, sizeof job->reason, c[3], n[3]);
    copy(job->nodes, sizeof job->nodes, c[4], n[4]);
    copy(job->comment, sizeof job->comment, c[5], n[5]);
    job->wait_status = (int)strtol(number, NULL, 10);
    return isdigit((unsigned char)job->id[0]) && job->state[0] != '\0';
}

status slurm_parse_jobs(const char *text, struct slurm_job **out, size_t *n, struct error *err)
{
    size_t n_line = 1;
    for (const char *at = text; *at != '\0'; at++) n_line += *at == '\n';
    struct slurm_job *job = calloc(n_line, sizeof *job);
    *n = 0;
    if (job == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read Slurm's list of jobs: out of memory");
    for (const char *at = text; *at != '\0';) {
        size_t length = strcspn(at, "\n");
        *n += read_job(at, length, &job[*n]);
        at += length + (at[length] == '\n');
    }
    *out = job;
    return STATUS_OK;
}

bool slurm_parse_account(const char *text, const char *id, struct slurm_job *job)
{
    const char *c[N_ACCOUNT_COLUMN];
    size_t n[N_ACCOUNT_COLUMN];
    for (const char *at = text; *at != '\0';) {
        size_t length = strcspn(at, "\n");
        *job = (struct slurm_job){0};
        if (split(at, length, c, n, N_ACCOUNT_COLUMN) == N_ACCOUNT_COLUMN) {
            copy(job->id, sizeof job->id, c[0], n[0]);
            copy(job->state, sizeof job->state, c[1], strcspn(c[1], " |\n")); /* "CANCELLED by 1000" */
            copy(job->nodes, sizeof job->nodes, c[3], n[3]);
            char *rest;
            long code = strtol(c[2], &rest, 10), number = *rest == ':' ? strtol(rest + 1, NULL, 10) : 0;
            job->wait_status = (int)(code << 8 | number);
            struct worker_end end;
            if (strcmp(job->id, id) == 0) return slurm_phase_of(job, false, &end) == BACKEND_ENDED;
        }
        at += length + (at[length] == '\n');
    }
    return false;
}

enum slurm_failure slurm_failure_of(const struct slurm_output *output)
{
    /* messages of slurm_errno.h */
    static const struct {
        const char *text;
        enum slurm_failure kind;
    } known[] = {{"Socket timed out", SLURM_UNCERTAIN}, /* these first: some commands try again, and print each try */
                 {"Zero Bytes were transmitted", SLURM_UNCERTAIN},
                 {"Unexpected message received", SLURM_UNCERTAIN},
                 {"Transport endpoint", SLURM_UNCERTAIN},
                 {"Connection reset", SLURM_UNCERTAIN},
                 {"Message receive failure", SLURM_UNCERTAIN},
                 {"Unable to contact slurm controller", SLURM_AWAY},
                 {"Unable to establish configuration source", SLURM_AWAY},
                 {"Connection refused", SLURM_AWAY},
                 {"No route to host", SLURM_AWAY},
                 {"in standby mode", SLURM_AWAY},
                 {"Resource temporarily unavailable", SLURM_AWAY},
                 {"munge", SLURM_AWAY},
                 {"uthentication", SLURM_AWAY},
                 {"PerJob", SLURM_REFUSED}, /* a limit of one job's size, as QOSMaxWallDurationPerJobLimit */
                 {"temporarily unable to accept job", SLURM_FULL},
                 {"Job violates accounting/QOS policy", SLURM_FULL}};
    if (output->code < 0) return SLURM_UNCERTAIN; /* it was ended while it tried */
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (strstr(output->error, known[i].text) != NULL) return known[i].kind;
    return SLURM_REFUSED;
}

static void read_code(int wait_status, bool ranks, struct worker_end *end)
{
    end->by_signal = WIFSIGNALED(wait_status);
    end->code = end->by_signal ? WTERMSIG(wait_status) : WEXITSTATUS(wait_status);
    if (!ranks || end->by_signal || end->code <= FIRST_SIGNAL_CODE) return;
    end->by_signal = true; /* srun adds 128 to the signal that ended a rank */
    end->code -= FIRST_SIGNAL_CODE;
}

enum backend_phase slurm_phase_of(const struct slurm_job *job, bool ranks, struct worker_end *end)
{
    size_t i = 0, n = sizeof meaning / sizeof *meaning;
    while (i < n && strcmp(meaning[i].state, job->state) != 0) i++;
    *end = (struct worker_end){0};
    if (i == n) return BACKEND_RUNS;
    if (meaning[i].phase != BACKEND_ENDED) return meaning[i].phase;
    end->cause = meaning[i].cause;
    if (meaning[i].why != NULL) snprintf(end->why, sizeof end->why, "%s", meaning[i].why);
    read_code(job->wait_status, ranks, end);
    if (end->cause != WORKER_ENDED) return BACKEND_ENDED;
    if (strcmp(job->state, "FAILED") == 0 && job->nodes[0] == '\0') {
        end->cause = WORKER_REFUSED; /* it never had a node, and no worker has run */
        snprintf(end->why, sizeof end->why, "Slurm gave up the job before it started: %s", job->reason);
    } else if (ranks && (end->by_signal ? end->code != SIGSYS : end->code == WORKER_LOST)) {
        end->cause = WORKER_INTERRUPTED; /* the other ranks end with it, and the job goes on from its checkpoint */
        snprintf(end->why, sizeof end->why, "a rank was lost (code %d)", end->code);
    } else if (!end->by_signal && end->code == WORKER_CANCELLED) {
        end->cause = WORKER_INTERRUPTED; /* the signal before the time limit, or before another job gets the node */
        snprintf(end->why, sizeof end->why, "Slurm has asked it to stop, and it has written a checkpoint");
    }
    return BACKEND_ENDED;
}
