#include "server/workers/lease_keeper.h"
#include "base/clock.h"
#include "server/jobs/job_access.h"
#include "server/jobs/job_change.h"
#include "server/store/store_cluster.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct lease_keeper {
    struct job_service *v;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool stop;           /* guarded by lock */
    double good_since_s; /* monotonic time since which renewals have been in time; 0: the last one failed */
    double renewed_s;    /* monotonic time at which the last renewal that succeeded began */
    char host[STORE_HOST_BYTES];
    atomic_uint n_loss;
};

static void read_line(const char *path, char *out, size_t n_out)
{
    FILE *f = fopen(path, "re");
    if (f == NULL || fgets(out, (int)n_out, f) == NULL) snprintf(out, n_out, "-");
    if (f != NULL) fclose(f);
    out[strcspn(out, "\n")] = '\0';
}

void lease_host_name(char *out, size_t n_out)
{
    char name[64] = "", boot[48], space[40] = "-";
    gethostname(name, sizeof name - 1);
    read_line("/proc/sys/kernel/random/boot_id", boot, sizeof boot);
    ssize_t n = readlink("/proc/self/ns/pid", space, sizeof space - 1);
    space[n > 0 ? n : 1] = '\0';
    snprintf(out, n_out, "%s %s %s", name, boot, space);
}

/* Daemons of this machine whose process has ended are known to have ended before their lease does. */
static void remove_neighbours(struct job_service *v, const char *host)
{
    struct daemon_row *row = NULL;
    size_t n = 0;
    if (store_daemon_list(v->store, &row, &n, NULL) != STATUS_OK) return;
    for (size_t i = 0; i < n; i++) {
        bool gone = strcmp(row[i].host, host) == 0 &&
                    (row[i].pid == (int64_t)getpid() || (kill((pid_t)row[i].pid, 0) != 0 && errno == ESRCH));
        char mine[STORE_ID_BYTES];
        store_daemon_id(v->store, mine);
        if (!gone || strcmp(row[i].id, mine) == 0) continue;
        if (store_daemon_remove(v->store, row[i].id, NULL) == STATUS_OK)
            log_info(v->log, "daemon %s (process %lld) has ended; its jobs are taken over", row[i].id,
                     (long long)row[i].pid);
    }
    free(row);
}

static void take_over(struct lease_keeper *k)
{
    struct job_service *v = k->v;
    const double lease_s = (double)v->settings->lease_s;
    struct error err = {0};
    int n = 0;
    remove_neighbours(v, k->host);
    if (k->good_since_s <= 0 || clock_monotonic_s() - k->good_since_s < lease_s) return;
    if (store_daemons_remove(v->store, lease_s, &n, &err) != STATUS_OK)
        log_warning(v->log, "lease: %s", err.text);
    else if (n > 0)
        log_warning(v->log, "the lease of %d daemon%s has ended; the jobs are taken over", n, n == 1 ? "" : "s");
}

static void renew(struct lease_keeper *k)
{
    struct job_service *v = k->v;
    const double lease_s = (double)v->settings->lease_s;
    const double begin_s = clock_monotonic_s();
    struct error err = {0};
    bool held = true;
    status s = store_daemon_renew(v->store, lease_s, &held, &err);
    if (s == STATUS_OK && !held) {
        log_warning(v->log, "this daemon has lost its lease, and others have its jobs; it goes on under a new one");
        s = store_daemon_begin(v->store, k->host, (int64_t)getpid(), lease_s, &err);
        atomic_fetch_add(&k->n_loss, 1);
    }
    if (s != STATUS_OK) {
        if (k->good_since_s > 0) log_warning(v->log, "the lease cannot be renewed: %s", err.text);
        k->good_since_s = 0;
        return;
    }
    /* A delay of this renewal may have delayed the renewals of other daemons, so their leases count again from here. */
    const double end_s = clock_monotonic_s();
    const bool late = !held || end_s - begin_s > lease_s / 4 || begin_s - k->renewed_s > lease_s / 2;
    k->renewed_s = begin_s;
    if (late || k->good_since_s <= 0) k->good_since_s = end_s;
    if (!late) take_over(k);
}

static void *run(void *context)
{
    struct lease_keeper *k = context;
    pthread_mutex_lock(&k->lock);
    while (!k->stop) {
        struct timespec until;
        clock_gettime(CLOCK_MONOTONIC, &until);
        int64_t pause_ms = k->v->settings->lease_s * 1000 / 4 + until.tv_nsec / 1000000;
        until.tv_sec += (time_t)(pause_ms / 1000);
        until.tv_nsec = (long)(pause_ms % 1000) * 1000000;
        while (!k->stop && pthread_cond_timedwait(&k->wake, &k->lock, &until) == 0) {
        }
        if (k->stop) break;
        pthread_mutex_unlock(&k->lock);
        renew(k);
        pthread_mutex_lock(&k->lock);
    }
    pthread_mutex_unlock(&k->lock);
    return NULL;
}

status lease_keeper_start(struct job_service *v, struct lease_keeper **out, struct error *err)
{
    *out = NULL;
    if (!store_is_shared(v->store)) return STATUS_OK;
    struct lease_keeper *k = calloc(1, sizeof *k);
    if (k == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep a lease: out of memory");
    k->v = v;
    k->good_since_s = k->renewed_s = clock_monotonic_s();
    lease_host_name(k->host, sizeof k->host);
    status s = store_daemon_begin(v->store, k->host, (int64_t)getpid(), (double)v->settings->lease_s, err);
    if (s != STATUS_OK) {
        free(k);
        return s;
    }
    remove_neighbours(v, k->host);
    pthread_mutex_init(&k->lock, NULL);
    pthread_condattr_t attr;
    pthread_condattr_init(&attr);
    pthread_condattr_setclock(&attr, CLOCK_MONOTONIC);
    pthread_cond_init(&k->wake, &attr);
    pthread_condattr_destroy(&attr);
    int e = pthread_create(&k->thread, NULL, run, k);
    if (e == 0) {
        *out = k;
        return STATUS_OK;
    }
    store_daemon_end(v->store, NULL);
    pthread_cond_destroy(&k->wake);
    pthread_mutex_destroy(&k->lock);
    free(k);
    errno = e;
    return error_set_errno(err, "cannot keep a lease");
}

void lease_keeper_stop(struct lease_keeper *k)
{
    if (k == NULL) return;
    pthread_mutex_lock(&k->lock);
    k->stop = true;
    pthread_cond_signal(&k->wake);
    pthread_mutex_unlock(&k->lock);
    pthread_join(k->thread, NULL);
    store_daemon_end(k->v->store, NULL);
    pthread_cond_destroy(&k->wake);
    pthread_mutex_destroy(&k->lock);
    free(k);
}

unsigned lease_keeper_losses(const struct lease_keeper *k) { return k == NULL ? 0 : atomic_load(&k->n_loss); }

bool lease_keeper_is_eldest(struct job_service *v)
{
    struct daemon_row *row = NULL;
    size_t n = 0;
    char mine[STORE_ID_BYTES];
    if (!store_is_shared(v->store)) return true;
    store_daemon_id(v->store, mine);
    size_t i = 0;
    bool eldest = store_daemon_list(v->store, &row, &n, NULL) == STATUS_OK;
    while (i < n && row[i].ended) i++; /* rows of daemons that have died, which nobody has removed yet */
    eldest = eldest && i < n && strcmp(row[i].id, mine) == 0;
    free(row);
    return eldest;
}

static void adopt(struct job_service *v, const char *id)
{
    struct job_row row;
    bool elsewhere = false;
    job_change_begin(v, id, NULL);
    /* another daemon may have been faster */
    status s = job_look(v, id, &row, NULL);
    if (s == STATUS_OK && row.state == JOB_RUNNING) s = store_job_elsewhere(v->store, id, &elsewhere, NULL);
    if (s == STATUS_OK && row.state == JOB_RUNNING && !elsewhere) {
        row.state = row.cancel_requested ? JOB_CANCELLED : JOB_QUEUED;
        if (row.cancel_requested) row.finished_unix_s = clock_wall_s();
        row.cancel_requested = false;
        if (job_update(v, &row, NULL) == STATUS_OK)
            log_info(v->log, "job %s was running when its daemon ended; it is now %s", id, job_state_name(row.state));
    }
    job_change_end(v);
}

void lease_keeper_adopt(struct job_service *v)
{
    char(*id)[STORE_ID_BYTES] = NULL;
    size_t n = 0;
    if (store_job_orphans(v->store, &id, &n, NULL) != STATUS_OK) return;
    for (size_t i = 0; i < n; i++) adopt(v, id[i]);
    free(id);
}
