/* Reads Slurm's list of jobs, and decides the phase of each run. */
#include "base/clock.h"
#include "optimizer/job/job_folder.h"
#include "server/files/worker_files.h"
#include "server/jobs/change_feed.h"
#include "server/workers/backends/slurm_service.h"

#include <dirent.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { AFTER_START_S = 30 };

/* Returns the exit code in the worker's last status, or -1 as long as this attempt has no final state. */
static int final_code(struct slurm_service *d, const struct backend_run *run, int64_t *peak_rss_bytes)
{
    static const struct {
        const char *state;
        int code;
    } final[] = {{"succeeded", WORKER_SUCCEEDED}, {"failed", WORKER_FAILED}, {"cancelled", WORKER_CANCELLED}};
    json_t *j = worker_status_read(d->v->settings->data, run->job_id);
    const char *state = json_string_value(json_object_get(j, "state"));
    int code = -1;
    bool own = json_integer_value(json_object_get(j, "attempt")) == run->attempt;
    for (size_t i = 0; own && state != NULL && i < 3; i++)
        if (strcmp(state, final[i].state) == 0) code = final[i].code;
    *peak_rss_bytes = own ? json_integer_value(json_object_get(j, "peak_rss_bytes")) : 0;
    json_decref(j);
    return code;
}

/* Writes the progress of the job: the number of finished stages and the size of the series. */
static void measure_progress(struct slurm_service *d, const struct backend_run *run, char *out, size_t n_out)
{
    char path[PATH_BYTES];
    struct stat st = {0};
    int n_done = 0;
    path_join(path, d->v->settings->data, "jobs", run->job_id, JOB_FILE_SERIES, NULL);
    if (stat(path, &st) != 0) st.st_size = 0;
    path_join(path, d->v->settings->data, "jobs", run->job_id, JOB_FOLDER_WORK, NULL);
    DIR *folder = opendir(path);
    for (struct dirent *e; folder != NULL && (e = readdir(folder)) != NULL;)
        n_done += strlen(e->d_name) > 5 && strcmp(e->d_name + strlen(e->d_name) - 5, ".done") == 0;
    if (folder != NULL) closedir(folder);
    snprintf(out, n_out, "%d stages, %lld bytes", n_done, (long long)st.st_size);
}

/* A start that ended at its time limit, or by the loss of a rank, is no loss when it got further than the one
 * before. */
static void judge_progress(struct slurm_service *d, struct backend_run *run, struct worker_end *end)
{
    char now[sizeof run->note.progress], text[sizeof end->why];
    measure_progress(d, run, now, sizeof now);
    /* TIMEOUT, or the signal before it; not a rank that was lost */
    const bool by_limit = end->cause == WORKER_OUT_OF_TIME || (!end->by_signal && end->code == WORKER_CANCELLED);
    bool moved = strcmp(now, run->note.progress) != 0 && strcmp(now, "0 stages, 0 bytes") != 0;
    snprintf(run->note.progress, sizeof run->note.progress, "%s", now);
    end->cause = moved ? WORKER_INTERRUPTED : WORKER_OUT_OF_TIME;
    if (moved) return;
    snprintf(text, sizeof text, "%.250s; the attempt finished no stage and no step%s", end->why,
             by_limit ? " (slurm.time_limit_s, slurm.warn_s)" : "");
    snprintf(end->why, sizeof end->why, "%s", text);
}

static bool has_waited(const struct slurm_service *d, struct backend_run *run, double least_s)
{
    double now_s = clock_monotonic_s(), wait_s = (double)d->v->settings->slurm_file_delay_s;
    if (run->gone_s <= 0) run->gone_s = now_s;
    return now_s - run->gone_s >= (wait_s > least_s ? wait_s : least_s);
}

/* Slurm says that the job has ended. */
static void ended(struct slurm_service *d, struct backend_run *run, struct worker_end *end)
{
    int code = final_code(d, run, &end->peak_rss_bytes);
    bool tells = end->cause == WORKER_ENDED && !end->by_signal && end->code <= WORKER_FAILED;
    /* on a shared file system the worker's last files may be seen later than its end */
    if (tells && code != end->code && !has_waited(d, run, 0)) return;
    if (end->cause == WORKER_OUT_OF_TIME) judge_progress(d, run, end);
    if (end->cause == WORKER_INTERRUPTED && strcmp(run->note.state, "FAILED") == 0) judge_progress(d, run, end);
    if (end->cause == WORKER_OUT_OF_MEMORY) run->note.least_memory_bytes = 2 * run->note.memory_bytes;
    log_info(d->v->log, "job %s: Slurm's job %s is %s%s%s", run->job_id, run->note.id, run->note.state,
             end->why[0] ? ": " : "", end->why);
    slurm_conclude(d, run, end);
}

/* Slurm does not list the job: it has forgotten its end, or never had it. */
static void missing(struct slurm_service *d, struct backend_run *run)
{
    struct worker_end end = {0};
    int code = final_code(d, run, &end.peak_rss_bytes);
    end.code = code;
    if (code < 0 && !has_waited(d, run, run->step == SLURM_TO_FIND ? AFTER_START_S : 0)) return;
    if (code < 0 && run->step == SLURM_TO_FIND) {
        end.cause = WORKER_NOT_STARTED;
    } else if (code < 0) {
        end.cause = WORKER_VANISHED;
        snprintf(end.why, sizeof end.why, "Slurm does not list its job %s any more, and the worker wrote no end",
                 run->note.id);
    }
    slurm_conclude(d, run, &end);
}

/* Asks the accounting, where there is one, for a job that squeue has forgotten. */
static bool ask_accounting(struct slurm_service *d, const struct backend_run *run, struct slurm_job *job)
{
    struct slurm_output out = {0};
    char of[SLURM_ID_BYTES + 8];
    snprintf(of, sizeof of, "--jobs=%s", run->note.id);
    const char *const argument[] = {
        d->sacct, "--noheader", "--parsable2", "--allocations", "--format=" SLURM_ACCOUNT_COLUMNS, of, NULL};
    if (d->sacct[0] == '\0' || run->step != SLURM_KNOWN) return false;
    if (slurm_command_run(d->v->settings, argument, NULL, &d->stop, &out, NULL) != STATUS_OK) return false;
    bool found = out.code == 0 && slurm_parse_account(out.text, run->note.id, job);
    if (strstr(out.error, "accounting storage is disabled") != NULL) d->sacct[0] = '\0';
    free(out.text);
    return found;
}

/* Takes over Slurm's state of a job. Returns whether it differs from before. */
static bool note_job(struct backend_run *run, const struct slurm_job *job, bool waits)
{
    struct backend_note *n = &run->note;
    bool same = strcmp(n->id, job->id) == 0 && strcmp(n->state, job->state) == 0 &&
                strcmp(n->reason, job->reason) == 0 && strcmp(n->nodes, job->nodes) == 0 && n->waits == waits;
    snprintf(n->id, sizeof n->id, "%s", job->id);
    snprintf(n->state, sizeof n->state, "%s", job->state);
    snprintf(n->reason, sizeof n->reason, "%s", job->reason);
    snprintf(n->nodes, sizeof n->nodes, "%s", job->nodes);
    n->waits = waits;
    return !same;
}

static void update(struct slurm_service *d, struct backend_run *run, const struct slurm_job *job, size_t n)
{
    struct worker_end end = {0};
    struct slurm_job account;
    size_t i = 0;
    for (; i < n; i++) {
        bool same_id = run->step == SLURM_KNOWN && strcmp(job[i].id, run->note.id) == 0;
        if (same_id || (run->step == SLURM_TO_FIND && strcmp(job[i].comment, run->comment) == 0)) break;
    }
    const struct slurm_job *is = i < n ? &job[i] : ask_accounting(d, run, &account) ? &account : NULL;
    if (is == NULL) {
        missing(d, run);
        return;
    }
    enum backend_phase phase = slurm_phase_of(is, d->v->settings->slurm_ranks > 1, &end);
    bool changed = note_job(run, is, phase == BACKEND_WAITS);
    if (changed) backend_note_write(d->v->settings->data, run->job_id, &run->note, run->step == SLURM_TO_FIND, NULL);
    pthread_mutex_lock(&d->lock);
    run->step = SLURM_KNOWN;
    if (phase != BACKEND_ENDED) run->phase = phase;
    pthread_mutex_unlock(&d->lock);
    if (phase == BACKEND_ENDED)
        ended(d, run, &end);
    else
        run->gone_s = 0;
    if (changed) change_feed_publish(d->v->feed, run->job_id);
}

/* Returns the run after this one (NULL: the first) that is to be looked for. Runs are added meanwhile at the front. */
static struct backend_run *next_to_look(struct slurm_service *d, struct backend_run *run)
{
    pthread_mutex_lock(&d->lock);
    run = run == NULL ? d->first : run->next;
    while (run != NULL && (run->released || (run->step != SLURM_KNOWN && run->step != SLURM_TO_FIND))) run = run->next;
    pthread_mutex_unlock(&d->lock);
    return run;
}

void slurm_look(struct slurm_service *d)
{
    struct slurm_output out = {0};
    struct slurm_job *job = NULL;
    struct error err = {0};
    size_t n = 0;
    char user[32];
    snprintf(user, sizeof user, "--user=%u", (unsigned)geteuid());
    const char *const argument[] = {d->squeue, "--noheader", user, "--states=all", "--Format=" SLURM_COLUMNS, NULL};
    status s = slurm_command_run(d->v->settings, argument, NULL, &d->stop, &out, &err);
    pthread_mutex_lock(&d->lock);
    d->looked_s = clock_monotonic_s();
    pthread_mutex_unlock(&d->lock);
    if (s == STATUS_OK && out.code == 0) s = slurm_parse_jobs(out.text, &job, &n, &err);
    if (s != STATUS_OK || out.code != 0) {
        slurm_note_trouble(d, "squeue", s != STATUS_OK ? err.text : out.error, false);
    } else {
        pthread_mutex_lock(&d->lock);
        bool was = d->trouble[0] != '\0' && !d->full;
        if (was) d->trouble[0] = '\0';
        pthread_mutex_unlock(&d->lock);
        if (was) log_info(d->v->log, "Slurm can be used again");
        for (struct backend_run *run = NULL; !d->stop && (run = next_to_look(d, run)) != NULL;) update(d, run, job, n);
    }
    free(job);
    free(out.text);
}
