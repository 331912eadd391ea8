#include "server/workers/supervisor.h"
#include "base/clock.h"
#include "server/events/change_feed.h"
#include "server/jobs/ballast.h"
#include "server/jobs/job_paths.h"
#include "server/workers/attempt.h"
#include "server/workers/console.h"
#include "server/workers/queue_turn.h"
#include "server/workers/worker_process.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <unistd.h>

enum { MAX_WORKER = 64, MAX_WAITING = 256, BURY_AGAIN_S = 60, BUSY_LOOK_MS = 100, IDLE_LOOK_MS = 1000 };

struct slot {
    bool used;
    char job_id[STORE_ID_BYTES], owner[STORE_OWNER_BYTES], batch[STORE_ID_BYTES];
    pid_t pid;
    int pid_fd;             /* becomes readable when the process ends; -1: the kernel has none */
    enum attempt_stop stop; /* reason for the request to stop */
    double seen_heartbeat_unix_s,
        heartbeat_seen_s; /* the last new heartbeat, and when it was seen (monotonic; at first the start) */
    double started_s;     /* monotonic time of the start */
    double asked_s;       /* monotonic time of the request to stop; 0: none */
    bool killed, ended;
    double retry_s; /* monotonic time of the next try to record its end in the database */
    struct worker_end end;
};

/* A queued job that must not start before a certain time, after a lost attempt or while another process has its
 * folder; or a deleted job whose folder could not be removed. */
struct waiting {
    char job_id[STORE_ID_BYTES];
    double until_s;
    int n_busy;
};

struct supervisor {
    struct job_service *v;
    char worker[PATH_BYTES];
    pthread_t thread;
    int wake_fd; /* an eventfd */
    atomic_bool stop;
    struct slot slot[MAX_WORKER];
    struct waiting waiting[MAX_WAITING];
    bool below_floor;
    double disk_seen_s;
};

static struct waiting *waiting_of(struct supervisor *u, const char *job_id, bool make)
{
    struct waiting *oldest = &u->waiting[0];
    for (size_t i = 0; i < MAX_WAITING; i++) {
        if (strcmp(u->waiting[i].job_id, job_id) == 0) return &u->waiting[i];
        if (u->waiting[i].until_s < oldest->until_s) oldest = &u->waiting[i];
    }
    if (!make) return NULL;
    *oldest = (struct waiting){0};
    snprintf(oldest->job_id, sizeof oldest->job_id, "%s", job_id);
    return oldest;
}

static void request_stop(struct slot *slot, enum attempt_stop why)
{
    if (slot->ended) return; /* the process has ended, so its id may belong to another process */
    if (slot->stop == STOP_NONE || why < slot->stop) slot->stop = why;
    if (slot->asked_s > 0) return;
    slot->asked_s = clock_monotonic_s();
    worker_signal(slot->pid, SIGTERM);
}

static void kill_now(struct slot *slot, enum attempt_stop why)
{
    if (slot->stop == STOP_NONE) slot->stop = why;
    if (slot->asked_s <= 0) slot->asked_s = clock_monotonic_s();
    slot->killed = true;
    worker_signal(slot->pid, SIGKILL);
}

static void record_end(struct supervisor *u, struct slot *slot)
{
    struct error err = {0};
    struct attempt_outcome outcome = {0};
    if (attempt_finish(u->v, slot->job_id, &slot->end, slot->stop, &outcome, &err) != STATUS_OK) {
        /* the database could not be written, so the row still says running: keep the slot and try again */
        log_error(u->v->log, "job %s: %s", slot->job_id, err.text);
        slot->retry_s = clock_monotonic_s() + 1;
        return;
    }
    slot->used = false;
    if (slot->pid_fd >= 0) close(slot->pid_fd);
    struct waiting *w = waiting_of(u, slot->job_id, outcome.delay_s > 0);
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

/* What made the worker hold so much would do it again, so it is killed at once and its job fails. */
static void check_memory(struct supervisor *u, struct slot *slot)
{
    const int64_t limit_bytes = u->v->settings->resident_limit_bytes;
    if (limit_bytes <= 0 || slot->killed) return;
    int64_t held_bytes = worker_memory_bytes(slot->pid);
    if (held_bytes <= limit_bytes) return;
    log_warning(u->v->log, "job %s: the worker holds %.1f MB of memory, more than %.1f MB, and is killed", slot->job_id,
                (double)held_bytes / 1e6, (double)limit_bytes / 1e6);
    kill_now(slot, STOP_MEMORY);
}

static void watch(struct supervisor *u, struct slot *slot)
{
    if (!slot->ended) slot->ended = worker_ended(slot->pid, &slot->end);
    trim_console(u, slot);
    double now = clock_monotonic_s();
    if (slot->ended) {
        if (now >= slot->retry_s) record_end(u, slot);
        return;
    }
    struct attempt_request request;
    bool known = attempt_read_request(u->v, slot->job_id, &request);
    if (request.deleted)
        kill_now(slot, STOP_CANCEL);
    else if (request.cancel)
        request_stop(slot, STOP_CANCEL);
    else if (u->below_floor)
        request_stop(slot, STOP_PAUSE);
    const int64_t limit_s = u->v->settings->time_limit_s;
    if (limit_s > 0 && now - slot->started_s > (double)limit_s) request_stop(slot, STOP_TIME);
    check_memory(u, slot);
    /* measured with our own clock between heartbeats: the wall clock may be set meanwhile, and one failed read is
     * not silence */
    if (request.heartbeat_unix_s > 0 && request.heartbeat_unix_s != slot->seen_heartbeat_unix_s) {
        slot->seen_heartbeat_unix_s = request.heartbeat_unix_s;
        slot->heartbeat_seen_s = now;
        change_feed_publish(u->v->feed, slot->job_id);
    }
    double silent_s = known ? now - slot->heartbeat_seen_s : 0;
    if (silent_s > (double)u->v->settings->heartbeat_timeout_s && !slot->killed) {
        log_warning(u->v->log, "job %s: the worker sent no heartbeat for %.0f s and is killed", slot->job_id, silent_s);
        kill_now(slot, STOP_SILENT);
    }
    if (slot->asked_s > 0 && !slot->killed && now - slot->asked_s > (double)u->v->settings->cancel_grace_s) {
        slot->killed = true;
        worker_signal(slot->pid, SIGKILL);
    }
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

static void launch(struct supervisor *u, const struct queued_job *job)
{
    const char *job_id = job->id;
    struct error err = {0};
    char folder[PATH_BYTES], console[PATH_BYTES], speeds[PATH_BYTES];
    path_join(folder, u->v->settings->data, "jobs", job_id, NULL);
    path_join(console, folder, "console.txt", NULL);
    status s = attempt_prepare(u->v, job_id, &err);
    if (s == STATUS_CONFLICT) return; /* cancelled or deleted meanwhile */
    if (s != STATUS_OK) {
        log_error(u->v->log, "job %s cannot be prepared; next try in 5 s: %s", job_id, err.text);
        waiting_of(u, job_id, true)->until_s = clock_monotonic_s() + 5;
        return;
    }
    struct slot *slot = u->slot;
    while (slot->used) slot++;
    *slot = (struct slot){
        .used = true, .pid_fd = -1, .heartbeat_seen_s = clock_monotonic_s(), .started_s = clock_monotonic_s()};
    snprintf(slot->job_id, sizeof slot->job_id, "%s", job_id);
    snprintf(slot->owner, sizeof slot->owner, "%s", job->owner);
    snprintf(slot->batch, sizeof slot->batch, "%s", job->batch);
    path_join(speeds, u->v->settings->data, "speeds.json", NULL);
    const struct worker_paths paths = {
        .program = u->worker, .job_folder = folder, .console = console, .speeds = speeds};
    s = worker_launch(&paths, u->v->settings, &slot->pid, &err);
    if (s == STATUS_OK) {
        slot->pid_fd = (int)syscall(SYS_pidfd_open, slot->pid, 0);
        log_info(u->v->log, "job %s: worker %d started", job_id, (int)slot->pid);
        return;
    }
    /* the row already says running, so the slot stays, as that of an ended worker, until the database is corrected */
    log_error(u->v->log, "job %s: %s", job_id, err.text);
    slot->ended = true;
    slot->end = (struct worker_end){.by_signal = false, .code = 127};
    record_end(u, slot);
    waiting_of(u, job_id, true)->until_s = clock_monotonic_s() + 2;
}

static bool may_start(struct supervisor *u, const char *job_id)
{
    const struct waiting *w = waiting_of(u, job_id, false);
    return !is_running(u, job_id) && (w == NULL || w->until_s <= clock_monotonic_s());
}

static void fill_slots(struct supervisor *u)
{
    struct queued_job *job = NULL;
    size_t n = 0, i, n_waiting = 0, free_slots = (size_t)u->v->settings->workers;
    free_slots -= n_running(u) < free_slots ? n_running(u) : free_slots;
    if (free_slots == 0 || u->below_floor) return;
    for (i = 0; i < MAX_WAITING; i++) n_waiting += u->waiting[i].until_s > clock_monotonic_s();
    /* as many of each owner and batch as may have to be passed over, or can start */
    if (store_job_queue(u->v->store, n_waiting + MAX_WORKER, &job, &n, NULL) != STATUS_OK || n == 0) return;
    struct queue_turn *turn = queue_turn_new(job, n);
    for (i = 0; turn != NULL && i < n; i++)
        if (!may_start(u, job[i].id)) queue_turn_skip(turn, i);
    for (i = 0; turn != NULL && i < MAX_WORKER; i++)
        if (u->slot[i].used) queue_turn_running(turn, u->slot[i].owner, u->slot[i].batch, 1);
    for (; turn != NULL && free_slots > 0 && (i = queue_turn_next(turn, clock_wall_s())) < n; free_slots--) {
        launch(u, &job[i]);
        queue_turn_running(turn, job[i].owner, job[i].batch, 1);
    }
    queue_turn_free(turn);
    free(job);
}

static void remove_deleted(struct supervisor *u)
{
    struct job_row *row = NULL;
    size_t n = 0;
    struct job_query q = {.deleted = true, .limit = 64};
    if (store_job_list(u->v->store, &q, &row, &n, NULL) != STATUS_OK) return;
    for (size_t i = 0; i < n; i++) {
        const struct waiting *w = waiting_of(u, row[i].id, false);
        if (is_running(u, row[i].id) || (w != NULL && w->until_s > clock_monotonic_s())) continue;
        char path[PATH_BYTES];
        struct error err = {0};
        path_join(path, u->v->settings->data, "jobs", row[i].id, NULL);
        status s = path_remove_tree(path, &err);
        if (s == STATUS_OK) s = store_job_erase(u->v->store, row[i].id, &err);
        if (s == STATUS_OK) continue;
        log_warning(u->v->log, "job %s is deleted, but a part of it could not be removed; next try in %d s: %s",
                    row[i].id, BURY_AGAIN_S, err.text);
        waiting_of(u, row[i].id, true)->until_s = clock_monotonic_s() + BURY_AGAIN_S;
    }
    job_rows_free(row, n);
}

static void check_disk(struct supervisor *u)
{
    long long free_bytes = 0;
    if (path_free_bytes(u->v->settings->data, &free_bytes, NULL) != STATUS_OK) return;
    int64_t floor_bytes = u->v->settings->floor_bytes;
    bool was = u->below_floor;
    /* hysteresis, so that jobs do not pause and resume repeatedly */
    u->below_floor = free_bytes < (was ? floor_bytes + floor_bytes / 10 : floor_bytes);
    if (u->below_floor && !was)
        log_warning(u->v->log, "%lld bytes are free, %lld are kept in reserve, so running jobs pause", free_bytes,
                    (long long)floor_bytes);
    if (!u->below_floor) attempt_resume_paused(u->v);
    if (!u->below_floor) ballast_keep(u->v->settings->data, u->v->settings->ballast_bytes);
}

static void tick(struct supervisor *u)
{
    double now = clock_monotonic_s();
    if (now - u->disk_seen_s > 2) {
        u->disk_seen_s = now;
        check_disk(u);
    }
    for (size_t i = 0; i < MAX_WORKER; i++)
        if (u->slot[i].used) watch(u, &u->slot[i]);
    remove_deleted(u);
    fill_slots(u);
}

static void stop_all(struct supervisor *u)
{
    for (size_t i = 0; i < MAX_WORKER; i++)
        if (u->slot[i].used) request_stop(&u->slot[i], STOP_SHUTDOWN);
    double give_up_s = clock_monotonic_s() + (double)u->v->settings->cancel_grace_s + 10;
    while (n_running(u) > 0 && clock_monotonic_s() < give_up_s) {
        for (size_t i = 0; i < MAX_WORKER; i++)
            if (u->slot[i].used) watch(u, &u->slot[i]);
        usleep(20000);
    }
}

/* Waits until a worker ends, supervisor_wake is called, or it is time to look at everything. */
static void wait_for_news(struct supervisor *u)
{
    struct pollfd news[MAX_WORKER + 1] = {{.fd = u->wake_fd, .events = POLLIN}};
    nfds_t n = 1;
    uint64_t n_wake;
    for (size_t i = 0; i < MAX_WORKER; i++)
        if (u->slot[i].used && !u->slot[i].ended && u->slot[i].pid_fd >= 0)
            news[n++] = (struct pollfd){.fd = u->slot[i].pid_fd, .events = POLLIN};
    if (poll(news, n, n_running(u) > 0 ? BUSY_LOOK_MS : IDLE_LOOK_MS) < 0) return;
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
    return NULL;
}

status supervisor_start(struct job_service *v, const char *worker_program, struct supervisor **out, struct error *err)
{
    if (access(worker_program, X_OK) != 0)
        return error_set_errno(err, "cannot execute worker program '%s'", worker_program);
    struct supervisor *u = calloc(1, sizeof *u);
    if (u == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start the supervisor: out of memory");
    u->v = v;
    u->disk_seen_s = -1e9;
    snprintf(u->worker, sizeof u->worker, "%s", worker_program);
    u->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    v->supervisor = u;
    int e = u->wake_fd < 0 ? errno : pthread_create(&u->thread, NULL, run, u);
    if (e != 0) {
        v->supervisor = NULL;
        if (u->wake_fd >= 0) close(u->wake_fd);
        free(u);
        errno = e;
        return error_set_errno(err, "cannot start the supervisor");
    }
    *out = u;
    return STATUS_OK;
}

const char *supervisor_program(const struct supervisor *u) { return u->worker; }

void supervisor_wake(struct supervisor *u)
{
    const uint64_t one = 1;
    if (write(u->wake_fd, &one, sizeof one) < 0) {
        /* the counter is full, so the supervisor is awake already */
    }
}

void supervisor_stop(struct supervisor *u)
{
    if (u == NULL) return;
    atomic_store(&u->stop, true);
    supervisor_wake(u);
    pthread_join(u->thread, NULL);
    u->v->supervisor = NULL;
    close(u->wake_fd);
    free(u);
}
