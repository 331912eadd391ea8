/* Workers on the nodes of a cluster, which Slurm chooses and starts. */
#include "base/clock.h"
#include "server/workers/backends/job_backend.h"
#include "server/workers/backends/slurm_request.h"
#include "server/workers/backends/slurm_service.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { LOOK_MS = 500, CANCEL_AGAIN_S = 30 };

static bool wants_cancel(const struct backend_run *run, double now_s)
{
    return run->stop && run->step == SLURM_KNOWN &&
           (run->stop_sent_s <= 0 || now_s - run->stop_sent_s > CANCEL_AGAIN_S);
}

/* Frees the runs that the supervisor has forgotten. Called with the lock. */
static void reap(struct slurm_service *d)
{
    for (struct backend_run **at = &d->first; *at != NULL;) {
        struct backend_run *run = *at;
        if (run->released) {
            *at = run->next;
            free(run);
        } else
            at = &run->next;
    }
}

/* Returns the earliest run with work for this step, or NULL. New runs are put in front. Called with the lock. */
static struct backend_run *next_work(struct slurm_service *d, bool submit, double now_s)
{
    struct backend_run *found = NULL;
    for (struct backend_run *run = d->first; run != NULL; run = run->next) {
        if (run->released) continue;
        if (submit ? run->step == SLURM_TO_SUBMIT : wants_cancel(run, now_s)) found = run;
    }
    return found;
}

/* Submits one job, so that cancelling and looking need not wait for many. */
static void work(struct slurm_service *d)
{
    struct backend_run *run;
    if (!d->stop && (run = next_work(d, true, 0)) != NULL) {
        pthread_mutex_unlock(&d->lock);
        slurm_submit(d, run);
        pthread_mutex_lock(&d->lock);
    }
    while (!d->stop && (run = next_work(d, false, clock_monotonic_s())) != NULL) {
        pthread_mutex_unlock(&d->lock);
        slurm_cancel(d, run);
        pthread_mutex_lock(&d->lock);
    }
    double poll_s = (double)d->v->settings->slurm_poll_s;
    bool look = d->trouble[0] != '\0' && !d->full ? clock_monotonic_s() >= d->not_before_s
                                                  : d->first != NULL && clock_monotonic_s() - d->looked_s >= poll_s;
    if (d->stop || !look) return;
    pthread_mutex_unlock(&d->lock);
    slurm_look(d);
    pthread_mutex_lock(&d->lock);
}

static void *run_service(void *context)
{
    struct slurm_service *d = context;
    pthread_mutex_lock(&d->lock);
    while (!d->stop) {
        struct timespec until;
        reap(d);
        work(d);
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_sec++;
        if (!d->stop && next_work(d, true, 0) == NULL) pthread_cond_timedwait(&d->changed, &d->lock, &until);
    }
    pthread_mutex_unlock(&d->lock);
    return NULL;
}

static status find_commands(struct slurm_service *d, struct error *err)
{
    const struct settings *settings = d->v->settings;
    char srun[PATH_BYTES]; /* the nodes look for it anew, in the same way */
    status s = slurm_request_check(settings, err);
    if (s == STATUS_OK) s = slurm_command_find(settings, "sbatch", d->sbatch, sizeof d->sbatch, err);
    if (s == STATUS_OK) s = slurm_command_find(settings, "squeue", d->squeue, sizeof d->squeue, err);
    if (s == STATUS_OK) s = slurm_command_find(settings, "scancel", d->scancel, sizeof d->scancel, err);
    if (s == STATUS_OK && settings->slurm_ranks > 1) s = slurm_command_find(settings, "srun", srun, sizeof srun, err);
    if (s == STATUS_OK && slurm_command_find(settings, "sacct", d->sacct, sizeof d->sacct, NULL) != STATUS_OK)
        d->sacct[0] = '\0';
    return s;
}

static status open_slurm(struct job_service *v, const char *program, void **state, struct error *err)
{
    pthread_condattr_t monotonic;
    struct slurm_service *d = calloc(1, sizeof *d);
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot use Slurm: out of memory");
    d->v = v;
    d->program = program;
    d->looked_s = -1e9;
    status s = find_commands(d, err);
    if (s == STATUS_OK) {
        pthread_condattr_init(&monotonic);
        pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
        pthread_mutex_init(&d->lock, NULL);
        pthread_cond_init(&d->changed, &monotonic);
        pthread_condattr_destroy(&monotonic);
        errno = pthread_create(&d->thread, NULL, run_service, d);
        if (errno != 0) s = error_set_errno(err, "cannot use Slurm");
    }
    if (s != STATUS_OK) {
        free(d);
        return s;
    }
    *state = d;
    return STATUS_OK;
}

static void close_slurm(void *state)
{
    struct slurm_service *d = state;
    pthread_mutex_lock(&d->lock);
    d->stop = true;
    pthread_cond_signal(&d->changed);
    pthread_mutex_unlock(&d->lock);
    pthread_join(d->thread, NULL);
    while (d->first != NULL) {
        struct backend_run *run = d->first;
        d->first = run->next;
        free(run);
    }
    pthread_cond_destroy(&d->changed);
    pthread_mutex_destroy(&d->lock);
    free(d);
}

static bool ready(void *state)
{
    struct slurm_service *d = state;
    pthread_mutex_lock(&d->lock);
    bool is = (d->trouble[0] == '\0' || d->full) && clock_monotonic_s() >= d->not_before_s &&
              (!d->one_by_one || next_work(d, true, 0) == NULL);
    pthread_mutex_unlock(&d->lock);
    return is;
}

static void trouble(void *state, char *text, size_t n_text)
{
    struct slurm_service *d = state;
    pthread_mutex_lock(&d->lock);
    snprintf(text, n_text, "%s", d->trouble);
    pthread_mutex_unlock(&d->lock);
}

/* Begins a run: a new one is submitted, one that is adopted is known by its note or must be found. */
static void begin_run(const struct slurm_service *d, struct backend_run *run, const struct job_row *row, bool adopt)
{
    struct backend_note *note = &run->note;
    snprintf(run->job_id, sizeof run->job_id, "%s", row->id);
    run->attempt = row->attempt;
    run->phase = BACKEND_WAITS;
    slurm_comment(row->id, row->attempt, run->comment);
    backend_note_read(d->v->settings->data, row->id, note);
    snprintf(note->backend, sizeof note->backend, "slurm");
    bool noted = note->attempt == row->attempt && note->id[0] != '\0';
    run->step = !adopt ? SLURM_TO_SUBMIT : noted ? SLURM_KNOWN : SLURM_TO_FIND;
    if (run->step != SLURM_TO_FIND) return;
    note->attempt = row->attempt;
    note->id[0] = '\0';
}

static void enlist(struct slurm_service *d, struct backend_run *run)
{
    pthread_mutex_lock(&d->lock);
    run->next = d->first;
    d->first = run;
    if (run->step != SLURM_TO_SUBMIT) d->looked_s = -1e9;
    pthread_cond_signal(&d->changed);
    pthread_mutex_unlock(&d->lock);
}

static status add_run(struct slurm_service *d, const char *job_id, bool adopt, struct backend_run **out,
                      struct error *err)
{
    struct job_row row;
    status s = store_job_look(d->v->store, job_id, &row, err);
    if (s != STATUS_OK) return s;
    *out = calloc(1, sizeof **out);
    if (*out != NULL) {
        begin_run(d, *out, &row, adopt);
        enlist(d, *out);
    } else
        s = error_set(err, STATUS_NO_MEMORY, "cannot submit job %s: out of memory", job_id);
    job_row_release(&row);
    return s;
}

static status start(void *state, const char *job_id, struct backend_run **run, struct error *err)
{
    return add_run(state, job_id, false, run, err);
}

static status adopt(void *state, const char *job_id, struct backend_run **run, struct error *err)
{
    return add_run(state, job_id, true, run, err);
}

static enum backend_phase look(void *state, struct backend_run *run, struct worker_end *end)
{
    struct slurm_service *d = state;
    pthread_mutex_lock(&d->lock);
    enum backend_phase phase = run->phase;
    *end = run->end;
    pthread_mutex_unlock(&d->lock);
    return phase;
}

static void stop(void *state, struct backend_run *run, bool at_once)
{
    struct slurm_service *d = state;
    pthread_mutex_lock(&d->lock);
    if (at_once && !run->at_once) run->stop_sent_s = 0;
    run->stop = true;
    run->at_once = run->at_once || at_once;
    pthread_cond_signal(&d->changed);
    pthread_mutex_unlock(&d->lock);
}

/* Slurm bounds the memory of its jobs itself. */
static int64_t memory_bytes(const struct backend_run *run)
{
    (void)run;
    return 0;
}

static int end_fd(const struct backend_run *run)
{
    (void)run;
    return -1;
}

static void release(void *state, struct backend_run *run)
{
    struct slurm_service *d = state;
    pthread_mutex_lock(&d->lock);
    run->released = true;
    pthread_mutex_unlock(&d->lock);
}

const struct job_backend backend_slurm = {.name = "slurm",
                                          .outlives_daemon = true,
                                          .look_ms = LOOK_MS,
                                          .open = open_slurm,
                                          .close = close_slurm,
                                          .ready = ready,
                                          .start = start,
                                          .adopt = adopt,
                                          .look = look,
                                          .stop = stop,
                                          .memory_bytes = memory_bytes,
                                          .end_fd = end_fd,
                                          .trouble = trouble,
                                          .release = release};
