/* Submits and cancels jobs. */
#include "base/clock.h"
#include "base/files/foreign_file.h"
#include "server/files/worker_files.h"
#include "server/workers/backends/slurm_request.h"
#include "server/workers/backends/slurm_service.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double first_pause_s = 1, longest_pause_s = 60;

void slurm_note_trouble(struct slurm_service *d, const char *command, const char *words, bool full)
{
    pthread_mutex_lock(&d->lock);
    if (full != d->full) d->pause_s = 0;
    d->pause_s = d->pause_s > 0 ? d->pause_s * 2 : first_pause_s;
    if (d->pause_s > longest_pause_s) d->pause_s = longest_pause_s;
    d->not_before_s = clock_monotonic_s() + d->pause_s;
    /* a limit is met again and again, and is logged once */
    bool begins = full ? !d->one_by_one : d->trouble[0] == '\0' || d->full;
    d->full = full;
    d->one_by_one = d->one_by_one || full;
    snprintf(d->trouble, sizeof d->trouble, "waits, because Slurm takes no jobs now: %.500s", words);
    pthread_mutex_unlock(&d->lock);
    if (begins && full) log_warning(d->v->log, "Slurm takes no more jobs at present (%s): %s", command, words);
    if (begins && !full) log_warning(d->v->log, "Slurm cannot be used (%s): %s", command, words);
}

void slurm_conclude(struct slurm_service *d, struct backend_run *run, const struct worker_end *end)
{
    struct error err = {0};
    run->note.waits = false;
    if (backend_note_write(d->v->settings->data, run->job_id, &run->note, false, &err) != STATUS_OK)
        log_warning(d->v->log, "job %s: %s", run->job_id, err.text);
    pthread_mutex_lock(&d->lock);
    run->end = *end;
    run->phase = BACKEND_ENDED;
    run->step = SLURM_OVER;
    pthread_mutex_unlock(&d->lock);
}

/* Makes the console new, as it is for a local worker. */
static status renew_console(const char *data, const char *job_id, struct error *err)
{
    char path[PATH_BYTES];
    path_join(path, data, "jobs", job_id, "console.txt", NULL);
    status s = foreign_file_clear(path, err);
    if (s != STATUS_OK) return s;
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd < 0) return error_set_errno(err, "cannot write '%s'", path);
    close(fd);
    return STATUS_OK;
}

/* Memory that the job's plan says; 0 without a plan. */
static int64_t planned_bytes(const struct slurm_service *d, const char *job_id)
{
    json_t *plan = worker_plan_read(d->v->settings->data, job_id);
    const double bytes = json_number_value(json_object_get(plan, "memory_bytes"));
    json_decref(plan);
    return bytes > 0 && bytes < 1e15 ? (int64_t)bytes : 0;
}

/* Prepares the command line and the script of sbatch. */
static status prepare(struct slurm_service *d, struct backend_run *run, struct slurm_request *request,
                      struct error *err)
{
    const struct settings *settings = d->v->settings;
    struct job_row row;
    struct file_row *file = NULL;
    size_t n = 0;
    status s = store_job_look(d->v->store, run->job_id, &row, err);
    if (s != STATUS_OK) return s;
    s = store_file_list(d->v->store, run->job_id, &file, &n, err);
    if (s == STATUS_OK) s = renew_console(settings->data, run->job_id, err);
    if (s == STATUS_OK) {
        const struct slurm_memory known = {planned_bytes(d, run->job_id), run->note.least_memory_bytes};
        const struct slurm_submission submission = {
            .sbatch = d->sbatch, .program = d->program, .row = &row, .need = slurm_need_of(settings, file, n, known)};
        s = slurm_request_make(settings, &submission, request, err);
        run->note.attempt = row.attempt;
        run->note.memory_bytes = submission.need.memory_bytes;
        run->note.id[0] = run->note.reason[0] = run->note.nodes[0] = '\0';
        snprintf(run->note.state, sizeof run->note.state, "SUBMITTING");
        run->note.waits = true;
    }
    if (s == STATUS_OK) s = backend_note_write(settings->data, run->job_id, &run->note, false, err);
    free(file);
    job_row_release(&row);
    return s;
}

static void set_step(struct slurm_service *d, struct backend_run *run, enum slurm_step step)
{
    pthread_mutex_lock(&d->lock);
    run->step = step;
    pthread_mutex_unlock(&d->lock);
}

/* Slurm has the job: its number is noted before anything else happens. */
static void submitted(struct slurm_service *d, struct backend_run *run, const char *id)
{
    struct error err = {0};
    snprintf(run->note.id, sizeof run->note.id, "%s", id);
    snprintf(run->note.state, sizeof run->note.state, "PENDING");
    /* without the note the job is found by its comment */
    if (backend_note_write(d->v->settings->data, run->job_id, &run->note, true, &err) != STATUS_OK)
        log_warning(d->v->log, "job %s: %s", run->job_id, err.text);
    log_info(d->v->log, "job %s: submitted to Slurm as job %s, with %lld MiB", run->job_id, id,
             (long long)(run->note.memory_bytes >> 20));
    pthread_mutex_lock(&d->lock);
    run->step = SLURM_KNOWN;
    d->pause_s = 0;
    d->not_before_s = 0;
    if (d->full) d->trouble[0] = '\0';
    d->full = false;
    pthread_mutex_unlock(&d->lock);
}

static void not_submitted(struct slurm_service *d, struct backend_run *run, const struct slurm_output *out)
{
    struct worker_end end = {.cause = WORKER_NOT_STARTED};
    const char *words = out->error[0] != '\0' ? out->error : "sbatch gave no number of a job";
    enum slurm_failure failure = slurm_failure_of(out);
    if (failure != SLURM_REFUSED) slurm_note_trouble(d, "sbatch", words, failure == SLURM_FULL);
    if (failure == SLURM_UNCERTAIN) {
        run->gone_s = 0;
        set_step(d, run, SLURM_TO_FIND);
        return;
    }
    if (failure == SLURM_REFUSED) {
        end.cause = WORKER_REFUSED;
        snprintf(end.why, sizeof end.why, "Slurm refuses the job: %.360s", words);
    }
    slurm_conclude(d, run, &end);
}

/* Whether the supervisor has given the run up, or Slurm takes no jobs now: then nothing is submitted. */
static bool is_off(struct slurm_service *d, const struct backend_run *run)
{
    pthread_mutex_lock(&d->lock);
    bool off = run->stop || (d->full ? clock_monotonic_s() < d->not_before_s : d->trouble[0] != '\0');
    pthread_mutex_unlock(&d->lock);
    return off;
}

void slurm_submit(struct slurm_service *d, struct backend_run *run)
{
    struct error err = {0};
    struct slurm_output out = {0};
    char id[SLURM_ID_BYTES];
    struct worker_end end = {.cause = WORKER_NOT_STARTED};
    struct slurm_request *request = is_off(d, run) ? NULL : malloc(sizeof *request);
    if (request == NULL) {
        slurm_conclude(d, run, &end);
        return;
    }
    status s = prepare(d, run, request, &err);
    if (s == STATUS_OK) s = slurm_command_run(d->v->settings, request->argument, request->script, &d->stop, &out, &err);
    if (s != STATUS_OK) {
        log_error(d->v->log, "job %s cannot be submitted: %s", run->job_id, err.text);
        if (s == STATUS_INVALID) end.cause = WORKER_REFUSED;
        if (s == STATUS_INVALID) snprintf(end.why, sizeof end.why, "%s", err.text);
        slurm_conclude(d, run, &end);
    } else if (out.code == 0 && slurm_parse_id(out.text, id))
        submitted(d, run, id);
    else
        not_submitted(d, run, &out);
    free(out.text);
    free(request);
}

/* Ends a worker at once by SIGKILL, and removes the job from Slurm's list in either case: a job that waits, or whose
 * node is gone, gets no signal. Slurm itself sends SIGTERM first and, after its KillWait, SIGKILL. */
void slurm_cancel(struct slurm_service *d, struct backend_run *run)
{
    const char *const kill[] = {d->scancel, "--signal=KILL", "--full", run->note.id, NULL};
    const char *const end[] = {d->scancel, run->note.id, NULL};
    struct error err = {0};
    struct slurm_output out = {0};
    pthread_mutex_lock(&d->lock);
    bool at_once = run->at_once;
    run->stop_sent_s = clock_monotonic_s();
    d->looked_s = -1e9; /* the end is near */
    pthread_mutex_unlock(&d->lock);
    if (at_once && slurm_command_run(d->v->settings, kill, NULL, &d->stop, &out, &err) == STATUS_OK) free(out.text);
    status s = slurm_command_run(d->v->settings, end, NULL, &d->stop, &out, &err);
    if (s != STATUS_OK || out.code != 0)
        log_warning(d->v->log, "job %s: Slurm's job %s cannot be cancelled; next try in 30 s: %s", run->job_id,
                    run->note.id, s != STATUS_OK ? err.text : out.error);
    if (s == STATUS_OK) free(out.text);
}
