#include "server/retention/retention_watch.h"
#include "server/retention/retention.h"
#include "server/store/store_cluster.h"

#include <errno.h>
#include <stdlib.h>
#include <time.h>

struct retention_watch {
    struct job_service *v;
    struct retention_limits limits;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    bool stop; /* guarded by lock */
};

static bool must_stop(struct retention_watch *w)
{
    pthread_mutex_lock(&w->lock);
    bool stop = w->stop;
    pthread_mutex_unlock(&w->lock);
    return stop;
}

static void look(struct retention_watch *w)
{
    struct retention_plan plan;
    struct retention_job removed = {0};
    struct error err = {0};
    if (!store_duty_is_mine(w->v->store, "retention")) return;
    if (retention_plan_make(w->v, &w->limits, &plan, &err) != STATUS_OK) {
        log_warning(w->v->log, "retention: %s", err.text);
        return;
    }
    for (size_t i = 0; i < plan.n && !must_stop(w); i++)
        if (retention_remove(w->v, plan.job[i].id, plan.job[i].reason, &removed, &err) != STATUS_OK)
            log_warning(w->v->log, "retention: %s", err.text);
    retention_plan_release(&plan);
}

static void *run(void *context)
{
    struct retention_watch *w = context;
    pthread_mutex_lock(&w->lock);
    while (!w->stop) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        until.tv_sec += (time_t)w->v->settings->retention_check_s;
        while (!w->stop && pthread_cond_timedwait(&w->changed, &w->lock, &until) == 0) {
        }
        if (w->stop) break;
        pthread_mutex_unlock(&w->lock);
        look(w);
        pthread_mutex_lock(&w->lock);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}

status retention_watch_start(struct job_service *v, struct retention_watch **out, struct error *err)
{
    const struct retention_limits limits = {v->settings->retention_max_age_days, v->settings->retention_max_bytes};
    *out = NULL;
    if (limits.max_age_days == 0 && limits.max_bytes == 0) return STATUS_OK;
    struct retention_watch *w = calloc(1, sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start retention: out of memory");
    w->v = v;
    w->limits = limits;
    pthread_mutex_init(&w->lock, NULL);
    pthread_condattr_t attr;
    pthread_condattr_init(&attr);
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    pthread_cond_init(&w->changed, &attr);
    pthread_condattr_destroy(&attr);
    int e = pthread_create(&w->thread, NULL, run, w);
    if (e == 0) {
        *out = w;
        return STATUS_OK;
    }
    pthread_cond_destroy(&w->changed);
    pthread_mutex_destroy(&w->lock);
    free(w);
    errno = e;
    return error_set_errno(err, "cannot start retention");
}

void retention_watch_stop(struct retention_watch *w)
{
    if (w == NULL) return;
    pthread_mutex_lock(&w->lock);
    w->stop = true;
    pthread_cond_signal(&w->changed);
    pthread_mutex_unlock(&w->lock);
    pthread_join(w->thread, NULL);
    pthread_cond_destroy(&w->changed);
    pthread_mutex_destroy(&w->lock);
    free(w);
}
