#include "optimizer/stages/run/worker_status.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/process.h"
#include "base/utf8.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/stages/run/job_clock.h"

#include <jansson.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_WARNING = 50, WARNING_BYTES = 512, HEARTBEAT_MS = 400 };

struct worker_status {
    const struct worker_folder *folder;
    struct log *log;
    const char *file; /* in the job's folder */
    pthread_t thread;
    bool running;
    atomic_bool cancel, stale, stop;
    pthread_mutex_t mutex; /* everything below */
    char stage[64], message[300];
    size_t i_stage, n_stage;
    double started_unix_s;
    struct job_clock clock;
    bool has_objective;
    size_t step;
    double objective, objective_se;
    json_t *verdict;          /* NULL: not reached */
    size_t n_warning, n_more; /* n_more: warnings that are in the log only */
    char warning[MAX_WARNING][WARNING_BYTES];
};

/* Keeps a text for status.json, which takes UTF-8 only; the cut may have split a character. */
static void keep(char *to, size_t n_bytes, const char *text)
{
    snprintf(to, n_bytes, "%s", text);
    utf8_repair(to);
}

static json_t *error_json(const struct error *error)
{
    if (error == NULL) return json_null();
    return json_pack("{s:s, s:s, s:s}", "code", status_name(error->code), "field", error->field, "text", error->text);
}

static bool any_stage_planned(const struct job_clock *c)
{
    for (size_t i = 0; i < c->n_stage; i++)
        if (c->stage[i].planned) return true;
    return false;
}

/* While the job is read no stage is planned yet, and between the speeds and the first stage they are being planned: no
 * plan and a part of one are no forecast. */
static struct job_clock_look look_at(struct worker_status *st)
{
    if (st->clock.stage[st->clock.i_stage].began && any_stage_planned(&st->clock))
        return job_clock_look(&st->clock, clock_monotonic_s());
    return (struct job_clock_look){
        .spread = NAN, .eta_s = NAN, .eta_low_s = NAN, .eta_high_s = NAN, .fraction = st->clock.shown};
}

/* To be called with the mutex held. */
static char *status_text(struct worker_status *st, const char *state, const struct error *error)
{
    struct job_clock_look look = look_at(st);
    if (strcmp(state, "running") != 0) look.eta_s = look.eta_low_s = look.eta_high_s = NAN;
    if (strcmp(state, "succeeded") == 0) look.fraction = 1.0;
    const struct process_use used = process_use();
    json_t *warnings = json_array();
    for (size_t i = 0; i < st->n_warning; i++) json_array_append_new(warnings, json_string(st->warning[i]));
    json_t *json = json_pack(
        "{s:s, s:I, s:s, s:I, s:I, s:f, s:f, s:o, s:o, s:o, s:f, s:f, s:s, s:o, s:o, s:o, s:o, s:o, s:I, s:f}", "state",
        state, "attempt", (json_int_t)st->folder->attempt, "stage", st->stage, "i_stage", (json_int_t)st->i_stage,
        "n_stage", (json_int_t)st->n_stage, "stage_fraction", st->clock.fraction, "fraction", look.fraction, "eta_s",
        json_number(look.eta_s), "eta_low_s", json_number(look.eta_low_s), "eta_high_s", json_number(look.eta_high_s),
        "heartbeat_unix_s", clock_wall_s(), "started_unix_s", st->started_unix_s, "message", st->message, "objective",
        st->has_objective ? json_number(st->objective) : json_null(), "objective_se",
        st->has_objective ? json_number(st->objective_se) : json_null(), "step",
        st->has_objective ? json_integer((json_int_t)st->step) : json_null(), "warnings", warnings, "error",
        error_json(error), "peak_rss_bytes", (json_int_t)used.peak_rss_bytes, "cpu_s", used.cpu_s);
    if (json != NULL)
        json_object_set_new(json, "verdict", st->verdict != NULL ? json_incref(st->verdict) : json_null());
    char *text = json != NULL ? json_dumps(json, JSON_REAL_PRECISION(12)) : NULL;
    json_decref(json);
    return text;
}

static void beat(struct worker_status *st)
{
    char path[WORKER_PATH_BYTES];
    struct error err = {0};
    if (worker_folder_check(st->folder, &err) == STATUS_STALE) {
        atomic_store(&st->stale, true);
        atomic_store(&st->cancel, true);
        return;
    }
    worker_folder_path(st->folder, st->file, NULL, path);
    pthread_mutex_lock(&st->mutex);
    char *text = status_text(st, "running", NULL);
    pthread_mutex_unlock(&st->mutex);
    /* a heartbeat that cannot be written, because the disk is full, must not end the job */
    if (text != NULL && durable_replace_volatile(path, text, strlen(text), &err) != STATUS_OK)
        log_warning(st->log, "%s", err.text);
    free(text);
}

static void *heartbeat(void *context)
{
    struct worker_status *st = context;
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    const struct timespec wait = {0, HEARTBEAT_MS * 1000000L};
    while (!atomic_load(&st->stop)) {
        beat(st);
        int signal_number = sigtimedwait(&set, NULL, &wait);
        if (signal_number > 0 && !atomic_load(&st->stop)) {
            log_info(st->log, "received %s: stopping", signal_number == SIGTERM ? "SIGTERM" : "SIGINT");
            atomic_store(&st->cancel, true);
        }
    }
    return NULL;
}

status worker_status_new(const struct worker_folder *folder, struct log *log, struct worker_status **out,
                         struct error *err)
{
    struct worker_status *st = calloc(1, sizeof *st);
    if (st == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start the worker: out of memory");
    st->folder = folder;
    st->log = log;
    st->file = JOB_FILE_STATUS;
    size_t n_stage;
    const struct speed_book none = {.n = 0};
    pipeline_stage_table(&n_stage);
    job_clock_init(&st->clock, n_stage, &none, clock_monotonic_s());
    st->started_unix_s = clock_wall_s();
    snprintf(st->message, sizeof st->message, "starting");
    pthread_mutex_init(&st->mutex, NULL);
    *out = st;
    return STATUS_OK;
}

status worker_status_start(const struct worker_folder *folder, struct log *log, const char *file,
                           struct worker_status **out, struct error *err)
{
    struct worker_status *st;
    status s = worker_status_new(folder, log, &st, err);
    if (s != STATUS_OK) return s;
    st->file = file;
    if (pthread_create(&st->thread, NULL, heartbeat, st) != 0) {
        worker_status_free(st);
        return error_set(err, STATUS_NO_MEMORY, "cannot start the worker: no thread");
    }
    st->running = true;
    *out = st;
    return STATUS_OK;
}

static void stop_thread(struct worker_status *st)
{
    if (!st->running) return;
    atomic_store(&st->stop, true);
    pthread_kill(st->thread, SIGINT); /* ends the wait */
    pthread_join(st->thread, NULL);
    st->running = false;
}

status worker_status_finish(struct worker_status *st, const char *state, const struct error *error, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    stop_thread(st);
    if (worker_status_stale(st)) return error_set(err, STATUS_STALE, "the attempt of this worker is no longer current");
    pthread_mutex_lock(&st->mutex);
    if (strcmp(state, "succeeded") == 0)
        snprintf(st->message, sizeof st->message, "done");
    else
        keep(st->message, sizeof st->message, error != NULL ? error->text : state);
    char *text = status_text(st, state, error);
    pthread_mutex_unlock(&st->mutex);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write the final status: out of memory");
    worker_folder_path(st->folder, st->file, NULL, path);
    status s = worker_folder_replace(st->folder, path, text, strlen(text), err);
    free(text);
    return s;
}

void worker_status_free(struct worker_status *st)
{
    if (st == NULL) return;
    stop_thread(st);
    pthread_mutex_destroy(&st->mutex);
    json_decref(st->verdict);
    free(st);
}

double worker_status_started_unix_s(const struct worker_status *st) { return st->started_unix_s; }
const atomic_bool *worker_status_cancel(const struct worker_status *st) { return &st->cancel; }
bool worker_status_stale(const struct worker_status *st) { return atomic_load(&st->stale); }

void worker_status_speeds(struct worker_status *st, const struct speed_book *book)
{
    size_t n_stage;
    pipeline_stage_table(&n_stage);
    pthread_mutex_lock(&st->mutex);
    const double began_s = st->clock.began_s; /* the inputs have been read since */
    job_clock_init(&st->clock, n_stage, book, clock_monotonic_s());
    st->clock.began_s = began_s;
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_plan(struct worker_status *st, size_t i_stage, const struct job_clock_work *work)
{
    pthread_mutex_lock(&st->mutex);
    job_clock_plan(&st->clock, i_stage, work);
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_plan_own(struct worker_status *st, size_t i_stage, const char *key, double seconds)
{
    pthread_mutex_lock(&st->mutex);
    job_clock_plan_own(&st->clock, i_stage, key, seconds);
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_plan_share(struct worker_status *st, size_t i_stage, const char *key, double share, size_t i_of)
{
    pthread_mutex_lock(&st->mutex);
    job_clock_plan_share(&st->clock, i_stage, key, share, i_of);
    pthread_mutex_unlock(&st->mutex);
}

struct job_clock_look worker_status_look(struct worker_status *st)
{
    pthread_mutex_lock(&st->mutex);
    struct job_clock_look look = job_clock_look(&st->clock, clock_monotonic_s());
    pthread_mutex_unlock(&st->mutex);
    return look;
}

double worker_status_expected_s(struct worker_status *st, size_t i_stage)
{
    pthread_mutex_lock(&st->mutex);
    double seconds = job_clock_expected_s(&st->clock, i_stage);
    pthread_mutex_unlock(&st->mutex);
    return seconds;
}

void worker_status_stage(struct worker_status *st, const char *name, const char *title, size_t i_stage, size_t n_stage)
{
    pthread_mutex_lock(&st->mutex);
    snprintf(st->stage, sizeof st->stage, "%s", name);
    keep(st->message, sizeof st->message, title);
    st->i_stage = i_stage;
    st->n_stage = n_stage;
    job_clock_begin(&st->clock, i_stage, clock_monotonic_s());
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_stage_end(struct worker_status *st, bool loaded)
{
    pthread_mutex_lock(&st->mutex);
    job_clock_end(&st->clock, loaded, clock_monotonic_s());
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_fraction(struct worker_status *st, double stage_fraction)
{
    pthread_mutex_lock(&st->mutex);
    job_clock_fraction(&st->clock, stage_fraction, clock_monotonic_s());
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_restart_eta(struct worker_status *st)
{
    pthread_mutex_lock(&st->mutex);
    job_clock_restart(&st->clock, clock_monotonic_s());
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_remember(struct worker_status *st, struct speed_book *book)
{
    pthread_mutex_lock(&st->mutex);
    job_clock_remember(&st->clock, book);
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_message(struct worker_status *st, const char *text)
{
    pthread_mutex_lock(&st->mutex);
    keep(st->message, sizeof st->message, text);
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_verdict(struct worker_status *st, json_t *verdict)
{
    pthread_mutex_lock(&st->mutex);
    json_decref(st->verdict);
    st->verdict = verdict;
    pthread_mutex_unlock(&st->mutex);
}

void worker_status_objective(struct worker_status *st, size_t step, double objective, double se)
{
    pthread_mutex_lock(&st->mutex);
    st->has_objective = true;
    st->step = step;
    st->objective = objective;
    st->objective_se = se;
    pthread_mutex_unlock(&st->mutex);
}

/* To be called with the mutex held. When the list is full, its last entry counts the other warnings. */
static void add_warning(struct worker_status *st, const char *text)
{
    if (st->n_warning < MAX_WARNING - 1) {
        keep(st->warning[st->n_warning++], WARNING_BYTES, text);
        return;
    }
    st->n_warning = MAX_WARNING;
    snprintf(st->warning[MAX_WARNING - 1], WARNING_BYTES, "%zu more warnings are in the job's log", ++st->n_more);
}

void worker_status_warn(struct worker_status *st, const char *format, ...)
{
    char text[2 * WARNING_BYTES];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    log_warning(st->log, "%s", text);
    pthread_mutex_lock(&st->mutex);
    bool known = false;
    for (size_t i = 0; i < st->n_warning; i++) known |= strncmp(st->warning[i], text, WARNING_BYTES - 1) == 0;
    if (!known) add_warning(st, text);
    pthread_mutex_unlock(&st->mutex);
}

size_t worker_status_n_warning(struct worker_status *st)
{
    pthread_mutex_lock(&st->mutex);
    size_t n = st->n_warning;
    pthread_mutex_unlock(&st->mutex);
    return n;
}

bool worker_status_warning(struct worker_status *st, size_t i, char *text, size_t n_bytes)
{
    pthread_mutex_lock(&st->mutex);
    bool found = i < st->n_warning;
    if (found) snprintf(text, n_bytes, "%s", st->warning[i]);
    pthread_mutex_unlock(&st->mutex);
    return found;
}
