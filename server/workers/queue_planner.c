#include "server/workers/queue_planner.h"
#include "base/clock.h"
#include "optimizer/job/job_folder.h"
#include "server/settings/job_paths.h"
#include "server/store/store_cluster.h"
#include "server/workers/input_judge.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Seconds between two looks at the queue, and that a job has waited before it is planned. At most so many jobs are
 * planned of each batch: the others are expected to take as long as these. Failures that are remembered. */
enum { LOOK_S = 3, WAITED_S = 3, EACH_OF_BATCH = 20, FAILED_MOST = 64 };

struct queue_planner {
    struct job_service *v;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    bool stop; /* guarded by lock */
    size_t n_failed;
    char failed[FAILED_MOST][STORE_ID_BYTES]; /* the last jobs that could not be planned, which are not tried again */
};

static bool has_failed(const struct queue_planner *p, const char *job_id)
{
    for (size_t i = 0; i < p->n_failed && i < FAILED_MOST; i++)
        if (strcmp(p->failed[i], job_id) == 0) return true;
    return false;
}

static bool must_stop(struct queue_planner *p)
{
    pthread_mutex_lock(&p->lock);
    const bool stop = p->stop;
    pthread_mutex_unlock(&p->lock);
    return stop || atomic_load(&p->v->stopping);
}

static void plan_one(struct queue_planner *p, const char *job_id)
{
    struct job_refusal refusal = {0};
    struct error err = {0};
    json_t *plan = NULL;
    const status s = input_plan(p->v, job_id, &plan, &refusal, &err);
    json_decref(plan);
    if (s == STATUS_OK || s == STATUS_CONFLICT || s == STATUS_NOT_FOUND) return;
    log_info(p->v->log, "job %s: cannot be planned: %s", job_id, err.text);
    memcpy(p->failed[p->n_failed++ % FAILED_MOST], job_id, STORE_ID_BYTES);
}

static void look(struct queue_planner *p)
{
    struct queued_job *job = NULL;
    struct error err = {0};
    size_t n = 0;
    if (!store_duty_is_mine(p->v->store, "plans")) return;
    if (store_job_queue(p->v->store, EACH_OF_BATCH, &job, &n, &err) != STATUS_OK) return;
    const double now = clock_wall_s();
    for (size_t i = 0; i < n && !must_stop(p); i++) {
        char path[PATH_BYTES];
        path_join(path, p->v->settings->data, "jobs", job[i].id, JOB_FILE_PLAN, NULL);
        if (now - job[i].queued_unix_s < WAITED_S || has_failed(p, job[i].id) || access(path, F_OK) == 0) continue;
        plan_one(p, job[i].id);
    }
    free(job);
}

static void *run(void *context)
{
    struct queue_planner *p = context;
    pthread_mutex_lock(&p->lock);
    while (!p->stop) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_sec += LOOK_S;
        while (!p->stop && pthread_cond_timedwait(&p->changed, &p->lock, &until) == 0) {
        }
        if (p->stop) break;
        pthread_mutex_unlock(&p->lock);
        look(p);
        pthread_mutex_lock(&p->lock);
    }
    pthread_mutex_unlock(&p->lock);
    return NULL;
}

status queue_planner_start(struct job_service *v, struct queue_planner **out, struct error *err)
{
    *out = NULL;
    if (!v->settings->plan_queued) return STATUS_OK;
    struct queue_planner *p = calloc(1, sizeof *p);
    if (p == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start the planner of the queue: out of memory");
    p->v = v;
    pthread_mutex_init(&p->lock, NULL);
    pthread_condattr_t attr;
    pthread_condattr_init(&attr);
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    pthread_cond_init(&p->changed, &attr);
    pthread_condattr_destroy(&attr);
    const int e = pthread_create(&p->thread, NULL, run, p);
    if (e == 0) {
        *out = p;
        return STATUS_OK;
    }
    pthread_cond_destroy(&p->changed);
    pthread_mutex_destroy(&p->lock);
    free(p);
    errno = e;
    return error_set_errno(err, "cannot start the planner of the queue");
}

void queue_planner_stop(struct queue_planner *p)
{
    if (p == NULL) return;
    pthread_mutex_lock(&p->lock);
    p->stop = true;
    pthread_cond_signal(&p->changed);
    pthread_mutex_unlock(&p->lock);
    pthread_join(p->thread, NULL);
    pthread_cond_destroy(&p->changed);
    pthread_mutex_destroy(&p->lock);
    free(p);
}
