#include "server/workers/attempt.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/file_tree.h"
#include "base/files/foreign_file.h"
#include "optimizer/job/job_folder.h"
#include "server/files/worker_files.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/settings/job_paths.h"
#include "server/store/store_cluster.h"
#include "server/views/result_version.h"
#include "server/workers/console.h"
#include "server/workers/picture_maker.h"

#include <signal.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Removes the checkpoints that belong to the input before an edit, and keeps its result as a version. */
static status clear_folder(struct job_service *v, struct job_row *row, struct error *err)
{
    static const char *const stale[] = {JOB_FILE_STATUS,       JOB_FILE_SERIES, JOB_FILE_LOG,     JOB_FOLDER_WORK,
                                        JOB_FOLDER_RESULTS,    JOB_FILE_RUN,    JOB_FILE_BACKEND, JOB_FILE_PICTURES,
                                        JOB_FILE_PICTURES_LOG, "console.txt"};
    char path[PATH_BYTES];
    const char *job_id = row->id;
    status s = version_keep(v, row, err);
    for (size_t i = 0; s == STATUS_OK && i < sizeof stale / sizeof stale[0]; i++) {
        path_join(path, v->settings->data, "jobs", job_id, stale[i], NULL);
        s = file_tree_remove(path, err);
    }
    return s;
}

/* Whether the file holds this text. It was synced when it was written, so it need not be written again. */
static bool holds(const char *folder, const char *name, const char *text)
{
    char *there = NULL;
    size_t n = 0, n_text = strlen(text);
    bool same = foreign_file_read(folder, name, n_text, &there, &n, NULL) == STATUS_OK && n == n_text &&
                memcmp(there, text, n) == 0;
    free(there);
    return same;
}

static status write_folder(struct job_service *v, const struct job_row *row, struct error *err)
{
    char folder[PATH_BYTES], path[PATH_BYTES], text[160];
    path_join(folder, v->settings->data, "jobs", row->id, NULL);
    path_join(path, folder, JOB_FILE_DOCUMENT, NULL);
    status s = STATUS_OK;
    if (!holds(folder, JOB_FILE_DOCUMENT, row->document))
        s = foreign_file_replace(path, row->document, strlen(row->document), true, err);
    path_join(path, folder, JOB_FILE_LETTERHEAD, NULL);
    if (s == STATUS_OK && !holds(folder, JOB_FILE_LETTERHEAD, v->letterhead))
        s = foreign_file_replace(path, v->letterhead, strlen(v->letterhead), true, err);
    if (s != STATUS_OK) return s;
    int n = snprintf(text, sizeof text, "{\"attempt\":%lld,\"token\":\"%s\"}\n", (long long)row->attempt, row->token);
    path_join(path, folder, JOB_FILE_ATTEMPT, NULL);
    return foreign_file_replace(path, text, (size_t)n, true, err);
}

static status prepare_locked(struct job_service *v, struct job_row *row, struct error *err)
{
    status s = STATUS_OK;
    if (row->state != JOB_QUEUED) return error_set(err, STATUS_CONFLICT, "job %s is not queued any more", row->id);
    if (row->dirty) s = clear_folder(v, row, err);
    if (s != STATUS_OK) return s;
    if (row->dirty || row->generation == 0) row->generation++;
    row->dirty = false;
    row->attempt++;
    unsigned char random[16];
    randombytes_buf(random, sizeof random);
    sodium_bin2hex(row->token, sizeof row->token, random, sizeof random);
    s = write_folder(v, row, err);
    if (s != STATUS_OK) return s;
    row->state = JOB_RUNNING;
    if (row->started_unix_s <= 0) row->started_unix_s = clock_wall_s();
    return job_update(v, row, err);
}

status attempt_prepare(struct job_service *v, const char *job_id, char token[STORE_ID_BYTES], struct error *err)
{
    struct job_row row;
    status s = store_job_claim(v->store, job_id, err);
    if (s != STATUS_OK) return s;
    job_change_begin(v, job_id, NULL);
    s = job_get(v, job_id, &row, err);
    if (s == STATUS_NOT_FOUND) s = STATUS_CONFLICT;
    if (s == STATUS_OK) s = prepare_locked(v, &row, err);
    job_change_end(v);
    if (s == STATUS_OK) atomic_fetch_add(&v->n_attempt_total, 1);
    if (s != STATUS_OK) store_job_unclaim(v->store, job_id, NULL);
    snprintf(token, STORE_ID_BYTES, "%s", row.token);
    job_row_release(&row);
    return s;
}

bool attempt_read_request(struct job_service *v, const char *job_id, bool computes, struct attempt_request *request)
{
    struct job_row row;
    *request = (struct attempt_request){0};
    if (store_job_look(v->store, job_id, &row, NULL) != STATUS_OK) return false;
    request->cancel = row.cancel_requested;
    request->deleted = row.deleted;
    json_t *j = computes ? worker_status_read(v->settings->data, job_id) : NULL;
    if (j != NULL && json_integer_value(json_object_get(j, "attempt")) == row.attempt)
        request->heartbeat_unix_s = json_number_value(json_object_get(j, "heartbeat_unix_s"));
    json_decref(j);
    job_row_release(&row);
    return true;
}

static void set_error(struct job_row *row, const char *code, const char *field, const char *text)
{
    snprintf(row->error_code, sizeof row->error_code, "%s", code);
    snprintf(row->error_field, sizeof row->error_field, "%s", field);
    snprintf(row->error_text, sizeof row->error_text, "%s", text);
}

/* The last words of a worker that died without an error in status.json. */
static void last_words(struct job_service *v, const char *job_id, char *out, size_t n_out)
{
    char path[PATH_BYTES];
    path_join(path, v->settings->data, "jobs", job_id, "console.txt", NULL);
    console_tail(path, out, n_out);
}

static void succeeded(struct job_service *v, struct job_row *row)
{
    json_t *j = worker_status_read(v->settings->data, row->id);
    const char *code = json_string_value(json_object_get(json_object_get(j, "verdict"), "code"));
    row->state = JOB_SUCCEEDED;
    snprintf(row->verdict, sizeof row->verdict, "%s", code == NULL ? "" : code);
    json_decref(j);
}

static void failed(struct job_service *v, struct job_row *row)
{
    json_t *j = worker_status_read(v->settings->data, row->id);
    json_t *e = json_object_get(j, "error");
    const char *code = json_string_value(json_object_get(e, "code")),
               *field = json_string_value(json_object_get(e, "field"));
    const char *text = json_string_value(json_object_get(e, "text"));
    char tail[400], made[640];
    row->state = JOB_FAILED;
    if (text != NULL && json_integer_value(json_object_get(j, "attempt")) == row->attempt)
        set_error(row, code == NULL ? "internal" : code, field == NULL ? "" : field, text);
    else {
        last_words(v, row->id, tail, sizeof tail);
        snprintf(made, sizeof made, "the worker failed without an error message%s%s",
                 tail[0] ? "; its last output: " : "", tail);
        set_error(row, "internal", "", made);
    }
    json_decref(j);
}

/* Where an engine has ended the worker, or has not started it. Returns false when the exit code decides. */
static bool apply_cause(const struct job_service *v, struct job_row *row, const struct worker_end *end,
                        struct attempt_outcome *outcome)
{
    switch (end->cause) {
    case WORKER_NOT_STARTED:
        row->state = JOB_QUEUED;
        outcome->delay_s = 1;
        break;
    case WORKER_INTERRUPTED:
        row->state = JOB_QUEUED;
        log_info(v->log, "job %s: attempt %lld was interrupted: %s", row->id, (long long)row->attempt, end->why);
        break;
    case WORKER_CANCELLED_OUTSIDE:
        row->state = JOB_CANCELLED;
        log_info(v->log, "job %s: %s", row->id, end->why);
        break;
    case WORKER_REFUSED:
        row->state = JOB_FAILED;
        set_error(row, "backend_refused", "", end->why);
        break;
    default:
        return false;
    }
    return true;
}

static void describe_end(struct job_service *v, const struct job_row *row, const struct worker_end *end,
                         enum attempt_stop stop, char *out, size_t n_out)
{
    char tail[300], how[sizeof end->why];
    last_words(v, row->id, tail, sizeof tail);
    if (stop == STOP_SILENT)
        snprintf(how, sizeof how, "the worker sent no heartbeat and was killed");
    else if (end->why[0] != '\0')
        snprintf(how, sizeof how, "%s", end->why);
    else if (end->by_signal && end->code == SIGKILL)
        snprintf(how, sizeof how, "the worker was killed (signal 9), perhaps because memory was out");
    else if (end->by_signal && end->code == SIGSYS)
        snprintf(how, sizeof how, "the worker's sandbox ended it, because it made a forbidden system call");
    else if (end->by_signal)
        snprintf(how, sizeof how, "the worker crashed with signal %d (%s)", end->code, strsignal(end->code));
    else if (end->code == WORKER_LOST)
        snprintf(how, sizeof how, "ranks of the job were lost again and again without progress");
    else if (end->code == 127)
        snprintf(how, sizeof how, "the worker could not be started");
    else
        snprintf(how, sizeof how, "the worker ended with the unknown code %d", end->code);
    snprintf(out, n_out, "%s; peak memory %.1f MB%s%s", how, (double)end->peak_rss_bytes / 1e6,
             tail[0] ? "; its last output: " : "", tail);
}

static void lost(struct job_service *v, struct job_row *row, const struct worker_end *end, enum attempt_stop stop,
                 struct attempt_outcome *outcome)
{
    char how[512], text[640];
    describe_end(v, row, end, stop, how, sizeof how);
    row->lost_attempts++;
    atomic_fetch_add(&v->n_lost_total, 1);
    log_warning(v->log, "job %s: attempt %lld was lost: %s", row->id, (long long)row->attempt, how);
    /* the same input would do it again */
    if (end->by_signal && end->code == SIGSYS) {
        row->state = JOB_FAILED;
        set_error(row, "forbidden_call", "", how);
        return;
    }
    if (row->lost_attempts >= v->settings->max_lost_attempts) {
        row->state = JOB_FAILED;
        snprintf(text, sizeof text, "%lld attempts were lost; the last one: %s", (long long)row->lost_attempts, how);
        set_error(row, "worker_lost", "", text);
        return;
    }
    row->state = JOB_QUEUED;
    outcome->delay_s = 0.5 * (double)row->lost_attempts;
}

static void time_is_up(const struct job_service *v, struct job_row *row)
{
    char text[160];
    snprintf(text, sizeof text, "the worker has run for %lld s, the limit of this service; retry resumes the job",
             (long long)v->settings->time_limit_s);
    row->state = JOB_FAILED;
    set_error(row, "time_limit", "", text);
}

/* The next attempt would exceed the limit again for the same reason. */
static void limit_exceeded(struct job_row *row, const char *code, const char *what, int64_t limit, const char *setting)
{
    char text[240];
    snprintf(text, sizeof text,
             "the worker %s %lld, the limit of this service (%s); with a higher limit, retry resumes the job", what,
             (long long)limit, setting);
    row->state = JOB_FAILED;
    set_error(row, code, "", text);
}

static void memory_is_out(const struct job_service *v, struct job_row *row)
{
    char text[240];
    snprintf(text, sizeof text,
             "the worker held more than %.1f MB of memory, the limit of this service (jobs.resident_limit_bytes); with "
             "a higher limit, retry resumes the job",
             (double)v->settings->resident_limit_bytes / 1e6);
    row->state = JOB_FAILED;
    set_error(row, "memory_limit", "", text);
}

static void apply_end(struct job_service *v, struct job_row *row, const struct worker_end *end, enum attempt_stop stop,
                      struct attempt_outcome *outcome)
{
    bool asked = stop == STOP_CANCEL || stop == STOP_SHUTDOWN || stop == STOP_PAUSE;
    const bool by_itself = end->cause == WORKER_ENDED && !end->by_signal;
    const struct settings *set = v->settings;
    if (stop == STOP_DEPTH)
        limit_exceeded(row, "folder_limit", "has nested folders more deeply than", set->folder_depth,
                       "jobs.folder_depth");
    else if (stop == STOP_THREADS && !row->cancel_requested)
        limit_exceeded(row, "thread_limit", "had more threads than", set->thread_limit, "jobs.thread_limit");
    else if (end->cause == WORKER_ENDED && end->by_signal && end->code == SIGXFSZ)
        limit_exceeded(row, "file_limit", "wrote a file of more bytes than", set->file_limit_bytes,
                       "jobs.file_limit_bytes");
    else if (by_itself && end->code == WORKER_SUCCEEDED)
        succeeded(v, row);
    else if (by_itself && end->code == WORKER_FAILED)
        failed(v, row);
    else if (stop == STOP_TIME && !row->cancel_requested)
        time_is_up(v, row);
    else if (stop == STOP_MEMORY && !row->cancel_requested)
        memory_is_out(v, row);
    else if (asked || row->cancel_requested)
        row->state = stop == STOP_PAUSE && !row->cancel_requested      ? JOB_PAUSED
                     : stop == STOP_SHUTDOWN && !row->cancel_requested ? JOB_QUEUED
                                                                       : JOB_CANCELLED;
    else if (stop == STOP_NONE && apply_cause(v, row, end, outcome))
        return;
    else if (by_itself && end->code == WORKER_USAGE)
        failed(v, row);
    else if (by_itself && end->code == WORKER_STALE) {
        row->state = JOB_QUEUED;
        outcome->busy = true;
        outcome->delay_s = 1;
    } else
        lost(v, row, end, stop, outcome);
}

/* Whatever a worker has put in place of the folders that inputs come to makes way for them. */
static void restore_folders(const struct job_service *v, const char *job_id)
{
    static const char *const part[] = {JOB_FOLDER_INPUT, "upload"};
    char path[PATH_BYTES];
    for (size_t i = 0; i < sizeof part / sizeof part[0]; i++) {
        struct error err = {0};
        path_join(path, v->settings->data, "jobs", job_id, part[i], NULL);
        if (foreign_folder_clear(path, &err) != STATUS_OK || durable_make_folder(path, &err) != STATUS_OK)
            log_warning(v->log, "job %s: %s", job_id, err.text);
    }
}

static void count_verdict(struct job_service *v, const char *id)
{
    enum verdict_code code;
    verdict_code_parse(id, &code);
    atomic_fetch_add(&v->n_verdict_total[code], 1);
}

status attempt_finish(struct job_service *v, const char *job_id, const char *token, const struct worker_end *end,
                      enum attempt_stop stop, struct attempt_outcome *outcome, struct error *err)
{
    struct job_row row;
    job_change_begin(v, job_id, NULL);
    status s = store_job_look(v->store, job_id, &row, err);
    if (s != STATUS_OK) goto out;
    if (row.state != JOB_RUNNING || strcmp(row.token, token) != 0) {
        log_warning(v->log, "job %s: the end of an attempt counts for nothing, because the job was taken over", job_id);
        goto out;
    }
    apply_end(v, &row, end, stop, outcome);
    restore_folders(v, job_id);
    if (end->peak_rss_bytes > row.peak_rss_bytes) row.peak_rss_bytes = end->peak_rss_bytes;
    bool over = row.state == JOB_SUCCEEDED || row.state == JOB_FAILED || row.state == JOB_CANCELLED;
    if (over) row.finished_unix_s = clock_wall_s();
    if (over) row.cancel_requested = false;
    s = job_update_surely(v, &row, err);
    if (s == STATUS_OK && over) atomic_fetch_add(&v->n_finished_total[row.state], 1);
    if (s == STATUS_OK && row.state == JOB_SUCCEEDED) count_verdict(v, row.verdict);
    if (s == STATUS_OK && row.state == JOB_SUCCEEDED) picture_list_add(v, job_id);
    if (s == STATUS_OK)
        log_info(v->log, "job %s is %s%s%s", job_id, job_state_name(row.state), row.error_text[0] ? ": " : "",
                 row.error_text);
out:
    job_change_end(v);
    job_row_release(&row);
    return s == STATUS_NOT_FOUND ? STATUS_OK : s;
}

status attempt_fail(struct job_service *v, const char *job_id, const char *why, struct error *err)
{
    struct job_row row;
    job_change_begin(v, job_id, NULL);
    status s = job_get(v, job_id, &row, err);
    if (s == STATUS_OK && row.state == JOB_QUEUED) {
        row.state = JOB_FAILED;
        row.finished_unix_s = clock_wall_s();
        set_error(&row, "conflict", "", why);
        s = job_update(v, &row, err);
    }
    job_change_end(v);
    job_row_release(&row);
    return s;
}

void attempt_resume_paused(struct job_service *v)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct job_query q = {.states = 1U << JOB_PAUSED, .limit = 1000};
    if (store_job_list(v->store, &q, &row, &n, NULL) != STATUS_OK) return;
    job_rows_free(row, n);
    if (n == 0) return;
    job_change_begin(v, NULL, NULL);
    if (store_job_list(v->store, &q, &row, &n, NULL) == STATUS_OK) {
        for (size_t i = 0; i < n; i++) {
            row[i].state = JOB_QUEUED;
            job_update(v, &row[i], NULL);
        }
        job_rows_free(row, n);
    }
    job_change_end(v);
}
