#include "server/jobs/queue_forecast.h"
#include "base/clock.h"
#include "optimizer/job/job_folder.h"
#include "server/files/worker_files.h"
#include "server/jobs/queue_turn.h"
#include "server/settings/job_paths.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { FORESEEN_MOST = 1000, SLOT_MOST = 256, RECENT = 15 };

struct foreseen {
    char id[STORE_ID_BYTES];
    struct queue_place place;
    double plan_s;           /* of its plan; NaN without one */
    struct timespec plan_at; /* when that file was written */
};

struct queue_forecast {
    pthread_mutex_t lock;
    double made_s; /* monotonic time; 0: never */
    struct foreseen *job;
    size_t n;
};

/* A worker, and whose job it has until when. */
struct worker_slot {
    char owner[STORE_OWNER_BYTES], batch[STORE_ID_BYTES];
    bool busy;
    double free_unix_s; /* INFINITY: unknown */
};

struct plan {
    struct worker_slot slot[SLOT_MOST];
    size_t n_slot;
    struct queued_job *job;
    size_t n_job;
    struct queue_turn *turn;
    double typical_s;       /* INFINITY: unknown */
    struct foreseen *known; /* of each job, in the order of `job`: id and plan; no id: not looked up */
    size_t n_first;         /* jobs at the begin of the queue that are looked up in any case */
    struct queue_forecast last;
};

struct queue_forecast *queue_forecast_new(void)
{
    struct queue_forecast *f = calloc(1, sizeof *f);
    if (f != NULL) pthread_mutex_init(&f->lock, NULL);
    return f;
}

void queue_forecast_free(struct queue_forecast *f)
{
    if (f == NULL) return;
    pthread_mutex_destroy(&f->lock);
    free(f->job);
    free(f);
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double typical_s(struct job_service *v)
{
    struct job_query q = {.states = 1U << JOB_SUCCEEDED, .order = JOB_BY_END, .limit = RECENT};
    struct job_row *row = NULL;
    size_t n = 0;
    double took_s[RECENT];
    if (store_job_list(v->store, &q, &row, &n, NULL) != STATUS_OK) return INFINITY;
    for (size_t i = 0; i < n; i++) took_s[i] = row[i].finished_unix_s - row[i].started_unix_s;
    job_rows_free(row, n);
    if (n == 0) return INFINITY;
    qsort(took_s, n, sizeof took_s[0], by_value);
    return fmax(took_s[n / 2], 0);
}

/* ---- plans ---- */

static double plan_s(struct job_service *v, const char *job_id)
{
    json_t *plan = worker_plan_read(v->settings->data, job_id);
    const json_t *wall = json_object_get(plan, "wall_s");
    const double s = json_is_number(wall) ? json_number_value(wall) : NAN;
    json_decref(plan);
    return s;
}

static int by_id(const void *a, const void *b)
{
    const struct foreseen *x = a, *y = b;
    return strcmp(x->id, y->id);
}

/* Finds the plan of queued job i. A plan whose file has not changed since the last forecast is not read again. */
static void look_up_plan(struct job_service *v, struct plan *p, size_t i)
{
    char path[PATH_BYTES];
    struct stat st;
    struct foreseen *one = &p->known[i];
    const struct queue_forecast *old = &p->last;
    memcpy(one->id, p->job[i].id, sizeof one->id);
    one->plan_s = NAN;
    path_join(path, v->settings->data, "jobs", one->id, JOB_FILE_PLAN, NULL);
    if (stat(path, &st) != 0) return;
    one->plan_at = st.st_mtim;
    const struct foreseen *before = old->n == 0 ? NULL : bsearch(one, old->job, old->n, sizeof *old->job, by_id);
    if (before != NULL && isfinite(before->plan_s) && before->plan_at.tv_sec == st.st_mtim.tv_sec &&
        before->plan_at.tv_nsec == st.st_mtim.tv_nsec)
        one->plan_s = before->plan_s;
    else
        one->plan_s = plan_s(v, one->id);
}

/* Returns the time that queued job i takes: of its plan, or the mean of its batch at the begin of the queue. */
static double takes_s(const struct plan *p, size_t i)
{
    double sum = 0, n = 0;
    if (isfinite(p->known[i].plan_s)) return p->known[i].plan_s;
    for (size_t k = 0; k < p->n_first && p->job[i].batch[0] != '\0'; k++)
        if (isfinite(p->known[k].plan_s) && strcmp(p->job[k].batch, p->job[i].batch) == 0) {
            sum += p->known[k].plan_s;
            n++;
        }
    return n > 0 ? sum / n : p->typical_s;
}

/* ---- running jobs ---- */

/* The time at which a running job will end. */
static double end_of(struct job_service *v, const struct job_row *row, double typical, double now)
{
    json_t *st = worker_status_read(v->settings->data, row->id);
    const json_t *eta = json_object_get(st, "eta_s");
    const bool says = json_is_number(eta) && json_integer_value(json_object_get(st, "attempt")) == row->attempt;
    double left_s = says ? json_number_value(eta) : plan_s(v, row->id) - (now - row->started_unix_s);
    if (!says && !isfinite(left_s)) left_s = typical - (now - row->started_unix_s);
    json_decref(st);
    return now + fmax(left_s, 0);
}

static void place_running(struct job_service *v, struct plan *p, double now)
{
    struct job_query q = {.states = 1U << JOB_RUNNING, .limit = SLOT_MOST};
    struct job_row *row = NULL;
    size_t n = 0, n_worker = (size_t)v->settings->workers;
    p->n_slot = n_worker < SLOT_MOST ? n_worker : SLOT_MOST;
    for (size_t i = 0; i < p->n_slot; i++) p->slot[i] = (struct worker_slot){.free_unix_s = now};
    if (store_job_list(v->store, &q, &row, &n, NULL) != STATUS_OK) return;
    for (size_t i = 0; i < n && i < p->n_slot; i++) {
        memcpy(p->slot[i].owner, row[i].owner, sizeof row[i].owner);
        memcpy(p->slot[i].batch, row[i].batch, sizeof row[i].batch);
        p->slot[i].busy = true;
        queue_turn_running(p->turn, row[i].owner, row[i].batch, 1);
        p->slot[i].free_unix_s = end_of(v, &row[i], p->typical_s, now);
    }
    job_rows_free(row, n);
}

static void foresee(struct job_service *v, struct queue_forecast *f, struct plan *p)
{
    while (f->n < FORESEEN_MOST) {
        struct worker_slot *slot = p->slot;
        for (size_t i = 1; i < p->n_slot; i++)
            if (p->slot[i].free_unix_s < slot->free_unix_s) slot = &p->slot[i];
        if (slot->busy) queue_turn_running(p->turn, slot->owner, slot->batch, -1);
        slot->busy = false;
        size_t next = queue_turn_next(p->turn, slot->free_unix_s);
        if (next == p->n_job) break;
        if (p->known[next].id[0] == '\0') look_up_plan(v, p, next);
        struct foreseen *one = &f->job[f->n++];
        *one = p->known[next];
        one->place.position = (int64_t)f->n;
        if (isfinite(slot->free_unix_s)) one->place.start_unix_s = 30 * ceil(slot->free_unix_s / 30);
        memcpy(slot->owner, p->job[next].owner, sizeof slot->owner);
        memcpy(slot->batch, p->job[next].batch, sizeof slot->batch);
        slot->busy = true;
        queue_turn_running(p->turn, slot->owner, slot->batch, 1);
        slot->free_unix_s += takes_s(p, next);
        if (isfinite(slot->free_unix_s)) one->place.end_unix_s = 30 * ceil(slot->free_unix_s / 30);
    }
    qsort(f->job, f->n, sizeof *f->job, by_id);
}

static void make(struct job_service *v, struct queue_forecast *f)
{
    struct plan *p = calloc(1, sizeof *p);
    struct foreseen *old = f->job;
    if (p != NULL) p->last = (struct queue_forecast){.job = f->job, .n = f->n};
    f->job = NULL;
    f->n = 0;
    if (p == NULL || store_job_queue(v->store, SIZE_MAX >> 1, &p->job, &p->n_job, NULL) != STATUS_OK || p->n_job == 0)
        goto out;
    p->n_first = p->n_job < FORESEEN_MOST ? p->n_job : FORESEEN_MOST;
    f->job = calloc(p->n_first, sizeof *f->job);
    p->known = calloc(p->n_job, sizeof *p->known);
    p->turn = queue_turn_new(p->job, p->n_job);
    if (f->job == NULL || p->known == NULL || p->turn == NULL) goto out;
    for (size_t i = 0; i < p->n_first; i++) look_up_plan(v, p, i);
    p->typical_s = typical_s(v);
    place_running(v, p, clock_wall_s());
    if (p->n_slot > 0) foresee(v, f, p);
out:
    free(old);
    if (p != NULL) {
        free(p->known);
        free(p->job);
        queue_turn_free(p->turn);
    }
    free(p);
}

struct queue_place queue_forecast_of(struct job_service *v, const char *job_id)
{
    struct queue_place place = {0};
    struct foreseen key = {0};
    struct queue_forecast *f = v->forecast;
    if (strlen(job_id) >= sizeof key.id) return place;
    memcpy(key.id, job_id, strlen(job_id));
    pthread_mutex_lock(&f->lock);
    if (f->made_s <= 0 || clock_monotonic_s() - f->made_s >= 1) {
        make(v, f);
        f->made_s = clock_monotonic_s();
    }
    const struct foreseen *found = f->n == 0 ? NULL : bsearch(&key, f->job, f->n, sizeof *f->job, by_id);
    if (found != NULL) place = found->place;
    pthread_mutex_unlock(&f->lock);
    return place;
}
