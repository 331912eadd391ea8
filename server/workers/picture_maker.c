#include "server/workers/picture_maker.h"
#include "base/clock.h"
#include "base/files/durable.h"
#include "base/files/foreign_file.h"
#include "base/files/foreign_json.h"
#include "optimizer/job/job_folder.h"
#include "server/settings/job_paths.h"
#include "server/store/store.h"
#include "server/workers/backends/worker_process.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* Seconds between two looks at the list and at the queue; tries of a job whose worker does not end by itself. */
enum { LOOK_S = 1, MOST_TRIES = 3 };

struct picture_maker {
    struct job_service *v;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    bool stop; /* guarded by lock */
    /* of the thread */
    pid_t pid; /* 0: no worker runs */
    char job_id[STORE_ID_BYTES];
    double asked_s; /* when the worker was asked to end (monotonic); 0: it was not */
    int n_try;      /* of job_id */
};

/* ---- the list ---- */

bool picture_list_exists(const struct job_service *v)
{
    return v->settings->pictures != 0 && strcmp(v->settings->backend, "local") == 0;
}

static void entry_path(const struct job_service *v, const char *job_id, char path[PATH_BYTES])
{
    path_join(path, v->settings->data, "pictures", job_id, NULL);
}

static void write_state(struct job_service *v, const char *job_id, const char *state)
{
    char path[PATH_BYTES], text[64];
    struct error err = {0};
    path_join(path, v->settings->data, "jobs", job_id, JOB_FILE_PICTURES, NULL);
    snprintf(text, sizeof text, "{\"state\": \"%s\", \"fraction\": 0}\n", state);
    if (foreign_file_replace(path, text, strlen(text), false, &err) != STATUS_OK)
        log_warning(v->log, "job %s: %s", job_id, err.text);
}

void picture_list_add(struct job_service *v, const char *job_id)
{
    char path[PATH_BYTES];
    struct error err = {0};
    if (!picture_list_exists(v)) return;
    write_state(v, job_id, "waiting");
    entry_path(v, job_id, path);
    if (durable_replace(path, "", 0, &err) != STATUS_OK) log_warning(v->log, "job %s: %s", job_id, err.text);
}

void picture_list_remove(struct job_service *v, const char *job_id)
{
    char path[PATH_BYTES];
    entry_path(v, job_id, path);
    if (unlink(path) == 0) write_state(v, job_id, "cancelled");
}

json_t *picture_list_view(struct job_service *v, const char *job_id)
{
    static const struct foreign_bounds bounds = {.file_bytes = 256 << 10, .held_bytes = 1 << 20, .depth = 16};
    static const char *const known[] = {"waiting", "running", "succeeded", "failed", "cancelled"};
    char folder[PATH_BYTES];
    json_t *said = NULL;
    const char *state = "none";
    path_join(folder, v->settings->data, "jobs", job_id, NULL);
    foreign_json_read(folder, JOB_FILE_PICTURES, &bounds, &said, NULL);
    const char *is = json_string_value(json_object_get(said, "state"));
    for (size_t i = 0; is != NULL && i < sizeof known / sizeof *known; i++)
        if (strcmp(is, known[i]) == 0) state = known[i];
    const double fraction = json_number_value(json_object_get(said, "stage_fraction"));
    const char *text = json_string_value(json_object_get(json_object_get(said, "error"), "text"));
    json_t *view = json_pack("{s:s, s:f, s:s?}", "state", state, "fraction",
                             strcmp(state, "succeeded") == 0     ? 1.0
                             : fraction > 0.0 && fraction <= 1.0 ? fraction
                                                                 : 0.0,
                             "error", text);
    json_decref(said);
    return view;
}

static void take_off(const struct job_service *v, const char *job_id)
{
    char path[PATH_BYTES];
    entry_path(v, job_id, path);
    unlink(path);
}

static bool is_listed(const struct job_service *v, const char *job_id)
{
    char path[PATH_BYTES];
    entry_path(v, job_id, path);
    return access(path, F_OK) == 0;
}

/* The entry that was added first. Returns false when the list is empty. */
static bool first_listed(const struct job_service *v, char job_id[STORE_ID_BYTES])
{
    char path[PATH_BYTES];
    struct timespec oldest = {0};
    bool found = false;
    path_join(path, v->settings->data, "pictures", NULL);
    DIR *list = opendir(path);
    if (list == NULL) return false;
    for (const struct dirent *e; (e = readdir(list)) != NULL;) {
        struct stat st;
        if (e->d_name[0] == '.' || strlen(e->d_name) >= STORE_ID_BYTES) continue;
        if (fstatat(dirfd(list), e->d_name, &st, AT_SYMLINK_NOFOLLOW) != 0) continue;
        const struct timespec t = st.st_mtim;
        if (found && (t.tv_sec > oldest.tv_sec || (t.tv_sec == oldest.tv_sec && t.tv_nsec >= oldest.tv_nsec))) continue;
        found = true;
        oldest = t;
        snprintf(job_id, STORE_ID_BYTES, "%s", e->d_name);
    }
    closedir(list);
    return found;
}

/* ---- the worker ---- */

/* Whether a job waits or runs, or the database cannot say. */
static bool is_busy(const struct job_service *v)
{
    struct job_row *row = NULL;
    size_t n = 0;
    const struct job_query q = {.states = 1U << JOB_QUEUED | 1U << JOB_RUNNING, .limit = 1};
    if (store_job_list(v->store, &q, &row, &n, NULL) != STATUS_OK) return true;
    job_rows_free(row, n);
    return n > 0;
}

static bool has_succeeded(struct job_service *v, const char *job_id)
{
    struct job_row row = {0};
    struct error err = {0};
    const status s = store_job_get(v->store, job_id, &row, &err);
    const bool is = s == STATUS_OK && row.state == JOB_SUCCEEDED;
    job_row_release(&row);
    return is;
}

static void launch(struct picture_maker *m, const char *job_id)
{
    char folder[PATH_BYTES], console[PATH_BYTES], speeds[PATH_BYTES];
    struct error err = {0};
    path_join(folder, m->v->settings->data, "jobs", job_id, NULL);
    path_join(console, folder, "console.txt", NULL);
    path_join(speeds, m->v->settings->data, "speeds.json", NULL);
    const struct worker_paths paths = {
        .program = m->v->runner.program, .job_folder = folder, .console = console, .speeds = speeds, .pictures = true};
    m->n_try = strcmp(m->job_id, job_id) == 0 ? m->n_try + 1 : 1;
    m->asked_s = 0;
    snprintf(m->job_id, sizeof m->job_id, "%s", job_id);
    if (m->n_try > MOST_TRIES || worker_launch(&paths, m->v->settings, &m->pid, &err) != STATUS_OK) {
        log_warning(m->v->log, "job %s: no pictures: %s", job_id,
                    m->n_try > MOST_TRIES ? "their worker was lost again and again" : err.text);
        m->pid = 0;
        take_off(m->v, job_id);
        write_state(m->v, job_id, "failed");
        return;
    }
    log_info(m->v->log, "job %s: worker %d makes pictures", job_id, (int)m->pid);
}

/* What has been made stays; a worker that has ended by itself has nothing left to do. */
static void conclude(struct picture_maker *m, const struct worker_end *end)
{
    const bool asked = m->asked_s > 0, by_itself = !end->by_signal;
    m->pid = 0;
    if (asked) {
        m->n_try = 0;
        write_state(m->v, m->job_id, is_listed(m->v, m->job_id) ? "waiting" : "cancelled");
    } else if (by_itself && end->code != WORKER_STALE) {
        take_off(m->v, m->job_id);
        log_info(m->v->log, "job %s: pictures: code %d", m->job_id, end->code);
    }
}

static void watch(struct picture_maker *m)
{
    struct worker_end end;
    if (worker_ended(m->pid, &end)) {
        conclude(m, &end);
        return;
    }
    const double now_s = clock_monotonic_s();
    if (m->asked_s <= 0 && (is_busy(m->v) || !is_listed(m->v, m->job_id) || !has_succeeded(m->v, m->job_id) ||
                            atomic_load(&m->v->stopping))) {
        m->asked_s = now_s;
        worker_signal(m->pid, SIGTERM);
    }
    if (m->asked_s > 0 && now_s - m->asked_s > (double)m->v->settings->cancel_grace_s) worker_signal(m->pid, SIGKILL);
}

static void look(struct picture_maker *m)
{
    char job_id[STORE_ID_BYTES];
    if (m->pid != 0) {
        watch(m);
        return;
    }
    if (atomic_load(&m->v->stopping) || m->v->runner.program == NULL || !first_listed(m->v, job_id)) return;
    if (is_busy(m->v)) return;
    if (has_succeeded(m->v, job_id))
        launch(m, job_id);
    else
        take_off(m->v, job_id); /* it was deleted, or edited and run again */
}

static void *run(void *context)
{
    struct picture_maker *m = context;
    pthread_mutex_lock(&m->lock);
    while (!m->stop) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_sec += LOOK_S;
        while (!m->stop && pthread_cond_timedwait(&m->changed, &m->lock, &until) == 0) {
        }
        if (m->stop) break;
        pthread_mutex_unlock(&m->lock);
        look(m);
        pthread_mutex_lock(&m->lock);
    }
    pthread_mutex_unlock(&m->lock);
    while (m->pid != 0) {
        watch(m);
        usleep(20000);
    }
    return NULL;
}

status picture_maker_start(struct job_service *v, struct picture_maker **out, struct error *err)
{
    char path[PATH_BYTES];
    *out = NULL;
    if (!picture_list_exists(v)) return STATUS_OK;
    path_join(path, v->settings->data, "pictures", NULL);
    status s = durable_make_folder(path, err);
    struct picture_maker *m = s == STATUS_OK ? calloc(1, sizeof *m) : NULL;
    if (s != STATUS_OK) return s;
    if (m == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start the maker of pictures: out of memory");
    m->v = v;
    pthread_mutex_init(&m->lock, NULL);
    pthread_condattr_t attr;
    pthread_condattr_init(&attr);
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    pthread_cond_init(&m->changed, &attr);
    pthread_condattr_destroy(&attr);
    const int e = pthread_create(&m->thread, NULL, run, m);
    if (e == 0) {
        *out = m;
        return STATUS_OK;
    }
    pthread_cond_destroy(&m->changed);
    pthread_mutex_destroy(&m->lock);
    free(m);
    errno = e;
    return error_set_errno(err, "cannot start the maker of pictures");
}

void picture_maker_stop(struct picture_maker *m)
{
    if (m == NULL) return;
    pthread_mutex_lock(&m->lock);
    m->stop = true;
    pthread_cond_signal(&m->changed);
    pthread_mutex_unlock(&m->lock);
    pthread_join(m->thread, NULL);
    pthread_cond_destroy(&m->changed);
    pthread_mutex_destroy(&m->lock);
    free(m);
}
