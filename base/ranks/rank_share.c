/* Tasks that all ranks share (rank_team_share). */
#include "base/clock.h"
#include "base/ranks/rank_team.h"
#include "base/ranks/rank_team_data.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { RESULT_MESSAGE_BYTES = 1 << 20, WAIT_MS = 50 };

struct result_head {
    uint32_t i_task, n_bytes;
};

struct span {
    size_t next, end;
};

struct share {
    struct rank_team *team;
    const struct rank_work *work;
    const struct progress *progress;
    pthread_mutex_t lock;
    pthread_cond_t more;
    struct span own; /* tasks at hand that no other rank has */
    size_t common;   /* root: the first task that nobody has; helper: the first one that it may still be given */
    bool stop;       /* cancelled, or failed */
    struct error error;
    size_t n_thread;
    /* root */
    size_t n_done, n_ended;
    bool told; /* the helpers know that they are to stop */
    /* helper */
    struct span ahead;
    bool asked, last; /* waits for an answer; has got the last tasks */
    size_t *done, n_unsent;
    char *message;
    size_t message_bytes;
};

/* Tasks that are dealt out beforehand: rank r has the r-th span of this length. */
static size_t first_span(const struct share *s) { return s->work->n_task / (2 * s->team->n_rank); }

static void fail(struct share *s, const struct error *why)
{
    if (s->error.code == STATUS_OK) s->error = *why;
    s->stop = true;
}

static bool take_from(struct span *span, size_t *i_task)
{
    if (span->next >= span->end) return false;
    *i_task = span->next++;
    return true;
}

/* ---- the root ---- */

static bool unpack_results(struct share *s, const struct rank_frame *frame)
{
    const char *at = s->team->buffer, *end = at + frame->n_bytes;
    while (at < end) {
        struct result_head h;
        if ((size_t)(end - at) < sizeof h) return false;
        memcpy(&h, at, sizeof h);
        at += sizeof h;
        if (h.n_bytes > (size_t)(end - at) || h.i_task >= s->work->n_task) return false;
        if (!s->work->unpack(s->work->context, h.i_task, at, h.n_bytes)) return false;
        at += h.n_bytes;
        s->n_done++;
        s->team->traffic.result_bytes += h.n_bytes;
    }
    progress_report(s->progress, (double)s->n_done / (double)s->work->n_task);
    return true;
}

static void assign(struct share *s, size_t peer)
{
    size_t left = s->work->n_task - s->common, n = left / (2 * s->team->n_rank);
    struct error err = {0};
    if (n == 0 && left > 0) n = 1;
    if (s->stop) n = 0;
    const uint64_t span[2] = {s->common, n};
    s->common += n;
    if (rank_team_send(s->team, peer, RANK_ASSIGN, span, sizeof span, &err) != STATUS_OK) fail(s, &err);
}

/* With the lock held. */
static void answer(struct share *s, const struct rank_frame *frame)
{
    struct error err = {0};
    if (frame->kind == RANK_REFUSE) {
        rank_team_refusal(s->team, frame, &err);
        fail(s, &err);
        s->n_ended++;
        return;
    }
    if (!unpack_results(s, frame)) {
        error_set(&err, STATUS_FORMAT, "rank %u sent results that are none", frame->peer);
        fail(s, &err);
    }
    if (frame->kind == RANK_REQUEST) assign(s, frame->peer);
    if (frame->kind == RANK_DONE) s->n_ended++;
}

static void tell_to_stop(struct share *s)
{
    if (progress_cancelled(s->progress)) s->stop = true;
    if (!s->stop || s->told) return;
    s->told = true;
    for (size_t r = 1; r < s->team->n_rank; r++) rank_team_send(s->team, r, RANK_CANCEL, NULL, 0, NULL);
}

/* Answers the messages that are there; waits for the first one at most wait_ms. */
static void serve(struct share *s, int wait_ms)
{
    struct rank_frame frame;
    struct error err = {0};
    status st = STATUS_OK;
    for (bool got = true; got && st == STATUS_OK; wait_ms = 0) {
        size_t before = s->team->traffic.n_message;
        st = rank_team_receive(s->team, wait_ms, &got, &frame, &err);
        pthread_mutex_lock(&s->lock);
        if (got && st == STATUS_OK) answer(s, &frame);
        if (st != STATUS_OK) fail(s, &err);
        tell_to_stop(s);
        pthread_mutex_unlock(&s->lock);
        got = s->team->traffic.n_message != before;
    }
}

static bool take_in_root(void *context, size_t i_thread, size_t *i_task)
{
    struct share *s = context;
    if (i_thread == 0) serve(s, 0);
    pthread_mutex_lock(&s->lock);
    bool got = !s->stop && take_from(&s->own, i_task);
    if (!got && !s->stop && s->common < s->work->n_task) {
        *i_task = s->common++;
        got = true;
    }
    pthread_mutex_unlock(&s->lock);
    if (got || i_thread != 0) return got;
    double start_s = clock_monotonic_s();
    while (s->n_ended + 1 < s->team->n_rank && !s->team->broken) serve(s, WAIT_MS);
    s->team->traffic.wait_s += clock_monotonic_s() - start_s;
    return false;
}

static void run_in_root(void *context, size_t i_task, size_t i_thread)
{
    struct share *s = context;
    double begin_s = clock_thread_s();
    s->work->run(s->work->context, i_task, i_thread);
    begin_s = clock_thread_s() - begin_s;
    pthread_mutex_lock(&s->lock);
    s->team->traffic.own_cpu_s += begin_s;
    s->team->traffic.n_own++;
    s->n_done++;
    progress_report(s->progress, (double)s->n_done / (double)s->work->n_task);
    pthread_mutex_unlock(&s->lock);
}

/* ---- a helper; with the lock held unless it is said otherwise ---- */

static void send_message(struct share *s, enum rank_message kind)
{
    struct error err = {0};
    if (rank_team_send(s->team, 0, kind, s->message, s->message_bytes, &err) != STATUS_OK) fail(s, &err);
    s->message_bytes = 0;
}

/* Sends the results that the root does not have, the last of them in a message of this kind. */
static void send_results(struct share *s, enum rank_message kind)
{
    for (size_t i = 0; i < s->n_unsent; i++) {
        struct result_head h = {.i_task = (uint32_t)s->done[i]};
        char *to = s->message + s->message_bytes;
        h.n_bytes = (uint32_t)s->work->pack(s->work->context, s->done[i], to + sizeof h);
        memcpy(to, &h, sizeof h);
        s->message_bytes += sizeof h + h.n_bytes;
        if (s->message_bytes > RESULT_MESSAGE_BYTES) send_message(s, RANK_RESULT);
    }
    s->n_unsent = 0;
    send_message(s, kind);
}

static void take_note(struct share *s, const struct rank_frame *frame)
{
    uint64_t span[2] = {0, 0};
    struct error err = {0};
    if (frame->kind == RANK_ORDER) {
        rank_team_end_early(s->team);
        return;
    }
    bool good = frame->kind == RANK_ASSIGN && s->asked && frame->n_bytes == sizeof span;
    if (good) memcpy(span, s->team->buffer, sizeof span);
    /* the root gives later tasks each time, so no task comes twice, and done has room for all */
    if (!good || span[0] < s->common || span[0] > s->work->n_task || span[1] > s->work->n_task - span[0]) {
        error_set(&err, STATUS_FORMAT, "rank %u sent message %u, which assigns no tasks of rank %zu", frame->peer,
                  frame->kind, s->team->rank);
        fail(s, &err);
        return;
    }
    s->common = span[0] + span[1];
    s->ahead = (struct span){span[0], s->common};
    s->asked = false;
    s->last = span[1] == 0;
}

/* Without the lock. Reads the messages that are there; waits for the first one at most wait_ms. */
static void listen_to_root(struct share *s, int wait_ms)
{
    struct rank_frame frame;
    struct error err = {0};
    bool got;
    status st = rank_team_receive(s->team, wait_ms, &got, &frame, &err);
    pthread_mutex_lock(&s->lock);
    if (st != STATUS_OK) fail(s, &err);
    if (got) take_note(s, &frame);
    if (atomic_load(&s->team->cancel)) s->stop = true;
    pthread_cond_broadcast(&s->more);
    pthread_mutex_unlock(&s->lock);
}

static void move_up(struct share *s)
{
    if (s->own.next < s->own.end) return;
    s->own = s->ahead;
    s->ahead = (struct span){0, 0};
}

static bool next_task(struct share *s, size_t *i_task)
{
    move_up(s);
    return !s->stop && take_from(&s->own, i_task);
}

/* Sends results as soon as they may fill a message, so that they travel while this rank works on. */
static void send_early(struct share *s)
{
    if (s->n_unsent * s->work->most_bytes > RESULT_MESSAGE_BYTES) send_results(s, RANK_RESULT);
}

/* Asks for more before the last tasks at hand are begun, so that the answer is there when they are done. */
static void ask_in_time(struct share *s)
{
    move_up(s);
    if (s->asked || s->last || s->stop || s->ahead.next < s->ahead.end) return;
    if (s->own.end - s->own.next > s->n_thread) return;
    s->asked = true;
    send_results(s, RANK_REQUEST);
}

static bool take_in_helper(void *context, size_t i_thread, size_t *i_task)
{
    struct share *s = context;
    if (i_thread == 0) listen_to_root(s, 0);
    pthread_mutex_lock(&s->lock);
    bool got;
    while (!(got = next_task(s, i_task)) && !s->last && !s->stop) {
        ask_in_time(s);
        if (i_thread != 0) {
            pthread_cond_wait(&s->more, &s->lock);
            continue;
        }
        pthread_mutex_unlock(&s->lock);
        listen_to_root(s, WAIT_MS);
        pthread_mutex_lock(&s->lock);
    }
    ask_in_time(s);
    pthread_mutex_unlock(&s->lock);
    return got;
}

static void run_in_helper(void *context, size_t i_task, size_t i_thread)
{
    struct share *s = context;
    s->work->run(s->work->context, i_task, i_thread);
    pthread_mutex_lock(&s->lock);
    s->done[s->n_unsent++] = i_task;
    send_early(s);
    pthread_mutex_unlock(&s->lock);
}

/* ---- both ---- */

static status prepare(struct share *s, struct error *err)
{
    const size_t span = first_span(s), rank = s->team->rank, *first = s->work->first;
    s->own =
        first != NULL ? (struct span){first[rank], first[rank + 1]} : (struct span){rank * span, (rank + 1) * span};
    s->common = first != NULL ? s->work->n_task : s->team->n_rank * span;
    pthread_mutex_init(&s->lock, NULL);
    pthread_cond_init(&s->more, NULL);
    if (rank == 0) return STATUS_OK;
    const size_t room = RESULT_MESSAGE_BYTES + sizeof(struct result_head) + s->work->most_bytes;
    s->done = malloc((s->work->n_task + 1) * sizeof *s->done);
    s->message = room <= RANK_MESSAGE_MOST ? malloc(room) : NULL;
    return s->done != NULL && s->message != NULL
               ? STATUS_OK
               : error_set(err, STATUS_NO_MEMORY, "no memory for the results of %zu tasks", s->work->n_task);
}

static status conclude(struct share *s, struct error *err)
{
    if (s->error.code != STATUS_OK) {
        if (err != NULL) *err = s->error;
        return s->error.code;
    }
    if (s->stop) return error_set(err, STATUS_CANCELLED, "cancelled");
    if (s->team->rank == 0 && s->n_done != s->work->n_task)
        return error_set(err, STATUS_INTERNAL, "%zu of %zu tasks were run", s->n_done, s->work->n_task);
    return STATUS_OK;
}

status rank_team_share(struct rank_team *t, const struct rank_work *work, struct thread_pool *pool,
                       const struct progress *progress, struct error *err)
{
    struct share s = {.team = t, .work = work, .progress = progress, .n_thread = thread_pool_n_thread(pool)};
    const bool root = t->rank == 0;
    double start_s = clock_monotonic_s(), cpu_s = clock_process_s();
    status st = prepare(&s, err);
    if (st == STATUS_OK) {
        thread_pool_run_from(pool, root ? take_in_root : take_in_helper, root ? run_in_root : run_in_helper, &s);
        st = conclude(&s, err);
        if (!root && !t->broken && !t->ended && (st == STATUS_OK || st == STATUS_CANCELLED)) {
            send_results(&s, RANK_DONE); /* after anything else, the caller's rank_team_refuse tells the reason */
            t->answered = t->serial;
        }
    }
    t->traffic.n_share++;
    t->traffic.n_task += work->n_task;
    t->traffic.share_s += clock_monotonic_s() - start_s;
    t->traffic.share_cpu_s += clock_process_s() - cpu_s;
    pthread_mutex_destroy(&s.lock);
    pthread_cond_destroy(&s.more);
    free(s.done);
    free(s.message);
    return st;
}
