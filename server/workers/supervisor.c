#include "server/workers/supervisor.h"
#include "base/clock.h"
#include "server/jobs/change_feed.h"
#include "server/jobs/queue_turn.h"
#include "server/settings/job_paths.h"
#include "server/store/store_cluster.h"
#include "server/workers/attempt.h"
#include "server/workers/backends/job_backend.h"
#include "server/workers/console.h"
#include "server/workers/disk_watch.h"
#include "server/workers/lease_keeper.h"
#include "server/workers/removal.h"
#include "server/workers/waiting_list.h"
#include "server/workers/worker_limits.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

enum { MAX_WORKER = SETTING_MAX_WORKERS, IDLE_LOOK_MS = 1000, DEPTH_LOOK_S = 5, SHARED_RUNNING = 10000, RIVALS = 16 };

struct slot {
    bool used;
    char job_id[STORE_ID_BYTES], owner[STORE_OWNER_BYTES], batch[STORE_ID_BYTES], token[STORE_ID_BYTES];
    struct backend_run *run; /* NULL: its start has failed */
    enum attempt_stop stop;  /* reason for the request to stop */
    double seen_heartbeat_unix_s,
        heartbeat_seen_s;         /* the last new heartbeat, and when it was seen (monotonic; at first the start) */
    double started_s, computed_s; /* since when it computes (monotonic; 0: it waits), and how long it had before */
    double asked_s;               /* monotonic time of the request to stop; 0: none */
    bool killed, ended;
    double depth_seen_s; /* monotonic time of the last look at the depth of its folder */
    double retry_s;      /* monotonic time of the next try to record its end in the database */
    struct worker_end end;
};

struct supervisor {
    struct job_service *v;
    const struct job_backend *backend;
    void *engine; /* the backend's state */
    char worker[PATH_BYTES];
    pthread_t thread;
    int wake_fd; /* an eventfd */
    atomic_bool stop;
    struct slot slot[MAX_WORKER];
    struct waiting_list waiting;
    bool below_floor, adopted;
    double disk_seen_s, lease_seen_s;
    unsigned n_loss; /* of the lease, as far as it was seen */
};

static void request_stop(struct supervisor *u, struct slot *slot, enum attempt_stop why)
{
    if (slot->ended) return;
    if (slot->stop == STOP_NONE || why < slot->stop) slot->stop = why;
    if (slot->asked_s > 0) return;
    slot->asked_s = clock_monotonic_s();
    u->backend->stop(u->engine, slot->run, false);
}

static void kill_now(struct supervisor *u, struct slot *slot, enum attempt_stop why)
{
    if (slot->killed) return;
    if (slot->stop == STOP_NONE) slot->stop = why;
    if (slot->asked_s <= 0) slot->asked_s = clock_monotonic_s();
    slot->killed = true;
    u->backend->stop(u->engine, slot->run, true);
}

static void record_end(struct supervisor *u, struct slot *slot)
{
    struct error err = {0};
    struct attempt_outcome outcome = {0};
    if (attempt_finish(u->v, slot->job_id, slot->token, &slot->end, slot->stop, &outcome, &err) != STATUS_OK) {
        /* the database could not be written, so the row still says running: keep the slot and try again */
        log_error(u->v->log, "job %s: %s", slot->job_id, err.text);
        slot->retry_s = clock_monotonic_s() + 1;
        return;
    }
    slot->used = false;
    if (slot->run != NULL) u->backend->release(u->engine, slot->run);
    struct waiting *w = waiting_list_find(&u->waiting, slot->job_id, outcome.delay_s > 0);
    if (w == NULL) return;
    w->until_s = clock_monotonic_s() + outcome.delay_s;
    if (!outcome.busy)
        w->n_busy = 0;
    else if (++w->n_busy >= 60) {
        w->n_busy = 0;
        attempt_fail(u->v, slot->job_id, "another process holds the job's folder", NULL);
    }
}

static void trim_console(struct supervisor *u, const struct slot *slot)
{
    char path[PATH_BYTES];
    path_join(path, u->v->settings->data, "jobs", slot->job_id, "console.txt", NULL);
    console_trim(path);
}

static void check_limits(struct supervisor *u, struct slot *slot, double now)
{
    enum attempt_stop why = worker_limit_exceeded(u->v, u->backend, slot->run, slot->job_id);
    if (why == STOP_NONE && slot->started_s > 0 && now - slot->depth_seen_s > DEPTH_LOOK_S) {
        slot->depth_seen_s = now;
        why = worker_depth_exceeded(u->v, slot->job_id);
    }
    if (why != STOP_NONE) kill_now(u, slot, why);
}

/* Time limit and heartbeats do not count while the worker waits in its engine. */
static void note_phase(struct slot *slot, enum backend_phase phase, double now_s)
{
    slot->ended = phase == BACKEND_ENDED;
    if (phase == BACKEND_RUNS && slot->started_s <= 0) slot->started_s = slot->heartbeat_seen_s = now_s;
    if (phase == BACKEND_WAITS && slot->started_s > 0) slot->computed_s += now_s - slot->started_s;
    if (phase == BACKEND_WAITS) slot->started_s = 0;
}

static void watch(struct supervisor *u, struct slot *slot)
{
    double now = clock_monotonic_s();
    if (!slot->ended) note_phase(slot, u->backend->look(u->engine, slot->run, &slot->end), now);
    const bool computes = slot->started_s > 0;
    if (computes || slot->ended) trim_console(u, slot);
    if (slot->ended && slot->retry_s <= 0 && slot->stop == STOP_NONE)
        slot->stop = worker_depth_exceeded(u->v, slot->job_id);
    if (slot->ended && now >= slot->retry_s) record_end(u, slot);
    if (slot->ended) return;
    struct attempt_request request;
    const bool known = attempt_read_request(u->v, slot->job_id, computes, &request);
    if (request.deleted)
        kill_now(u, slot, STOP_CANCEL);
    else if (request.cancel)
        request_stop(u, slot, STOP_CANCEL);
    else if (u->below_floor)
        request_stop(u, slot, STOP_PAUSE);
    const int64_t limit_s = u->v->settings->time_limit_s;
    if (limit_s > 0 && computes && slot->computed_s + now - slot->started_s > (double)limit_s)
        request_stop(u, slot, STOP_TIME);
    if (!slot->killed) check_limits(u, slot, now);
    /* by our own clock, because the wall clock may be set meanwhile; one failed read is not silence */
    if (request.heartbeat_unix_s > 0 && request.heartbeat_unix_s != slot->seen_heartbeat_unix_s) {
        slot->seen_heartbeat_unix_s = request.heartbeat_unix_s;
        slot->heartbeat_seen_s = now;
        change_feed_publish(u->v->feed, slot->job_id);
    }
    double silent_s = known && computes ? now - slot->heartbeat_seen_s : 0;
    if (silent_s > (double)u->v->settings->heartbeat_timeout_s && !slot->killed) {
        log_warning(u->v->log, "job %s: the worker sent no heartbeat for %.0f s and is killed", slot->job_id, silent_s);
        kill_now(u, slot, STOP_SILENT);
    }
    if (slot->asked_s > 0 && now - slot->asked_s > (double)u->v->settings->cancel_grace_s)
        kill_now(u, slot, slot->stop);
}

static bool is_running(const struct supervisor *u, const char *job_id)
{
    for (size_t i = 0; i < MAX_WORKER; i++)
        if (u->slot[i].used && strcmp(u->slot[i].job_id, job_id) == 0) return true;
    return false;
}

static size_t n_running(const struct supervisor *u)
{
    size_t n = 0;
    for (size_t i = 0; i < MAX_WORKER; i++) n += u->slot[i].used;
    return n;
}

static struct slot *take_slot(struct supervisor *u, const char *job_id, const char *owner, const char *batch)
{
    struct slot *slot = u->slot;
    while (slot->used) slot++;
    *slot = (struct slot){.used = true};
    snprintf(slot->job_id, sizeof slot->job_id, "%s", job_id);
    snprintf(slot->owner, sizeof slot->owner, "%s", owner);
    snprintf(slot->batch, sizeof slot->batch, "%s", batch);
    return slot;
}

/* The row already says running, so the slot stays, as if its worker had ended, until the database is corrected. */
static void start_failed(struct supervisor *u, struct slot *slot, const struct error *err)
{
    char job_id[STORE_ID_BYTES];
    snprintf(job_id, sizeof job_id, "%s", slot->job_id);
    log_error(u->v->log, "job %s: %s", job_id, err->text);
    slot->ended = true;
    slot->end = (struct worker_end){.by_signal = false, .code = 127};
    record_end(u, slot);
    waiting_list_find(&u->waiting, job_id, true)->until_s = clock_monotonic_s() + 2;
}

/* Returns whether the job takes a slot. */
static bool launch(struct supervisor *u, const struct queued_job *job)
{
    struct error err = {0};
    char token[STORE_ID_BYTES];
    status s = attempt_prepare(u->v, job->id, token, &err);
    if (s == STATUS_CONFLICT) return false; /* cancelled or deleted meanwhile, or another daemon was faster */
    if (s != STATUS_OK) {
        log_error(u->v->log, "job %s cannot be prepared; next try in 5 s: %s", job->id, err.text);
        waiting_list_find(&u->waiting, job->id, true)->until_s = clock_monotonic_s() + 5;
        return false;
    }
    struct slot *slot = take_slot(u, job->id, job->owner, job->batch);
    memcpy(slot->token, token, sizeof token);
    if (u->backend->start(u->engine, job->id, &slot->run, &err) != STATUS_OK) start_failed(u, slot, &err);
    return true;
}

/* Takes over the jobs that an earlier daemon has started. Those that find no slot now are adopted later. */
static void adopt(struct supervisor *u)
{
    struct job_row *row = NULL;
    size_t n = 0, n_free = MAX_WORKER - n_running(u);
    struct job_query q = {.states = 1U << JOB_RUNNING, .limit = u->v->keeper != NULL ? SHARED_RUNNING : MAX_WORKER};
    if (u->adopted || u->backend->adopt == NULL) return;
    if (store_job_list(u->v->store, &q, &row, &n, NULL) != STATUS_OK) return;
    u->adopted = n < q.limit;
    for (size_t i = 0; i < n; i++) {
        struct error err = {0};
        if (is_running(u, row[i].id)) continue;
        if (n_free == 0) break;
        if (store_job_take(u->v->store, row[i].id, &err) != STATUS_OK) continue;
        n_free--;
        struct slot *slot = take_slot(u, row[i].id, row[i].owner, row[i].batch);
        memcpy(slot->token, row[i].token, sizeof slot->token);
        if (u->backend->adopt(u->engine, row[i].id, &slot->run, &err) != STATUS_OK) start_failed(u, slot, &err);
    }
    job_rows_free(row, n);
}

/* Whether neither a worker has the job nor a time is set before which it must be left alone. */
static bool is_free(void *context, const char *job_id)
{
    struct supervisor *u = context;
    return !is_running(u, job_id) && !waiting_list_holds(&u->waiting, job_id, clock_monotonic_s());
}

static void fill_slots(struct supervisor *u)
{
    struct queued_job *job = NULL;
    size_t n = 0, i, free_slots = (size_t)u->v->settings->workers;
    free_slots -= n_running(u) < free_slots ? n_running(u) : free_slots;
    if (free_slots == 0 || u->below_floor || !u->backend->ready(u->engine)) return;
    /* of each owner and batch those that may have to be passed over, that others may claim first, and that can start */
    size_t n_each = waiting_list_count(&u->waiting, clock_monotonic_s()) + free_slots;
    if (u->v->keeper != NULL) n_each += RIVALS;
    if (store_job_queue(u->v->store, n_each, &job, &n, NULL) != STATUS_OK || n == 0) return;
    struct queue_turn *turn = queue_turn_new(job, n);
    for (i = 0; turn != NULL && i < n; i++)
        if (!is_free(u, job[i].id)) queue_turn_skip(turn, i);
    for (i = 0; turn != NULL && i < MAX_WORKER; i++)
        if (u->slot[i].used) queue_turn_running(turn, u->slot[i].owner, u->slot[i].batch, 1);
    while (turn != NULL && free_slots > 0 && (i = queue_turn_next(turn, clock_wall_s())) < n) {
        if (!launch(u, &job[i])) continue;
        free_slots = u->backend->ready(u->engine) ? free_slots - 1 : 0;
        queue_turn_running(turn, job[i].owner, job[i].batch, 1);
    }
    queue_turn_free(turn);
    free(job);
}

/* Others have the jobs of a lease that was lost: workers are killed, but for those that others adopt. */
static void leave_jobs(struct supervisor *u)
{
    for (size_t i = 0; i < MAX_WORKER; i++) {
        struct slot *slot = &u->slot[i];
        if (!slot->used || slot->ended) continue;
        slot->used = !u->backend->outlives_daemon;
        slot->used ? kill_now(u, slot, STOP_SHUTDOWN) : u->backend->release(u->engine, slot->run);
    }
}

/* Takes over jobs that no daemon holds: backends whose workers outlive it adopt them, the others restart. */
static void keep_to_lease(struct supervisor *u, double now)
{
    unsigned n_loss = lease_keeper_losses(u->v->keeper);
    if (n_loss != u->n_loss) leave_jobs(u);
    u->n_loss = n_loss;
    if (u->v->keeper == NULL || now - u->lease_seen_s < 1) return;
    u->lease_seen_s = now;
    store_read_changes(u->v->store);
    u->adopted = false;
    if (u->backend->adopt == NULL) lease_keeper_adopt(u->v);
}

static void tick(struct supervisor *u)
{
    double now = clock_monotonic_s();
    keep_to_lease(u, now);
    if (now - u->disk_seen_s > 2) {
        u->disk_seen_s = now;
        u->below_floor = disk_watch(u->v, u->below_floor);
    }
    for (size_t i = 0; i < MAX_WORKER; i++)
        if (u->slot[i].used) watch(u, &u->slot[i]);
    removal_run(u->v, &u->waiting, is_free, u);
    adopt(u);
    fill_slots(u);
}

static void stop_all(struct supervisor *u)
{
    if (u->backend->outlives_daemon) return;
    for (size_t i = 0; i < MAX_WORKER; i++)
        if (u->slot[i].used) request_stop(u, &u->slot[i], STOP_SHUTDOWN);
    double give_up_s = clock_monotonic_s() + (double)u->v->settings->cancel_grace_s + 10;
    while (n_running(u) > 0 && clock_monotonic_s() < give_up_s) {
        for (size_t i = 0; i < MAX_WORKER; i++)
            if (u->slot[i].used) watch(u, &u->slot[i]);
        usleep(20000);
    }
}

/* Waits until a worker ends, `wake` is called, or it is time to look at everything. */
static void wait_for_news(struct supervisor *u)
{
    struct pollfd news[MAX_WORKER + 1] = {{.fd = u->wake_fd, .events = POLLIN}};
    nfds_t n = 1;
    uint64_t n_wake;
    for (size_t i = 0; i < MAX_WORKER; i++) {
        const struct slot *slot = &u->slot[i];
        int fd = slot->used && !slot->ended ? u->backend->end_fd(slot->run) : -1;
        if (fd >= 0) news[n++] = (struct pollfd){.fd = fd, .events = POLLIN};
    }
    if (poll(news, n, n_running(u) > 0 ? u->backend->look_ms : IDLE_LOOK_MS) < 0) return;
    if ((news[0].revents & POLLIN) != 0 && read(u->wake_fd, &n_wake, sizeof n_wake) < 0)
        log_warning(u->v->log, "the supervisor cannot read its counter: %s", strerror(errno));
}

static void *run(void *context)
{
    struct supervisor *u = context;
    while (!atomic_load(&u->stop)) {
        tick(u);
        wait_for_news(u);
    }
    stop_all(u);
    u->backend->close(u->engine);
    return NULL;
}

static void write_trouble(void *context, char *text, size_t n_text)
{
    const struct supervisor *u = context;
    text[0] = '\0';
    if (u->backend->trouble != NULL) u->backend->trouble(u->engine, text, n_text);
}

static void wake(void *context)
{
    const struct supervisor *u = context;
    if (eventfd_write(u->wake_fd, 1) != 0) {
        /* the counter is full, so the supervisor is awake already */
    }
}

status supervisor_start(struct job_service *v, const char *worker_program, struct supervisor **out, struct error *err)
{
    struct supervisor *u = calloc(1, sizeof *u);
    if (u == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start the supervisor: out of memory");
    u->v = v;
    u->disk_seen_s = -1e9;
    snprintf(u->worker, sizeof u->worker, "%s", worker_program);
    u->backend = job_backend_find(v->settings->backend);
    status s = u->backend->open(v, u->worker, &u->engine, err);
    if (s != STATUS_OK) {
        free(u);
        return s;
    }
    u->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    v->runner = (struct job_runner){.program = u->worker, .wake = wake, .trouble = write_trouble, .context = u};
    int e = u->wake_fd < 0 ? errno : pthread_create(&u->thread, NULL, run, u);
    if (e != 0) {
        v->runner = (struct job_runner){0};
        if (u->wake_fd >= 0) close(u->wake_fd);
        u->backend->close(u->engine);
        free(u);
        errno = e;
        return error_set_errno(err, "cannot start the supervisor");
    }
    *out = u;
    return STATUS_OK;
}

void supervisor_stop(struct supervisor *u)
{
    if (u == NULL) return;
    atomic_store(&u->stop, true);
    wake(u);
    pthread_join(u->thread, NULL);
    u->v->runner = (struct job_runner){0};
    close(u->wake_fd);
    free(u);
}
