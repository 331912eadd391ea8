#include "server/http/connection_table.h"
#include "base/clock.h"

#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

enum { RATE_GRACE_S = 10, GONE_GRACE_S = 2, MEAN_RATE_BYTES_PER_S = 65536 };
static const char too_slow_body[] =
    "{\"type\":\"urn:selvedge:problem:too_slow\",\"title\":\"The request came too slowly\",\"status\":408,"
    "\"code\":\"too_slow\",\"detail\":\"the head or the body of the request came too slowly\"}";

enum phase { PHASE_HEAD, PHASE_BODY, PHASE_WORK, PHASE_SEND };

struct connection_entry {
    struct connection_entry *next, *before;
    int fd;
    enum phase phase;
    double since_s;
    bool served; /* a request was answered on this connection, so a 408 could be taken for the answer to the next one */
    bool ended;
    atomic_uint_least64_t n_received; /* bytes of the present body */
    int64_t memory_bytes;             /* size of the present body, if it is kept in memory */
    atomic_bool consuming;            /* a piece of it is being stored */
    double window_s;                  /* begin of the present window of RATE_GRACE_S of a body or an answer */
    uint64_t window_bytes;            /* bytes that had been received, or that the client had acknowledged, then */
    bool bound;                       /* `thread` and `handle` are set */
    pthread_t thread;
    void *handle;
};

struct connection_table {
    pthread_mutex_t lock;
    struct connection_entry *first;
    size_t n;
    double header_deadline_s;
    double min_rate_bytes_per_s;
    bool answers;
};

status connection_table_new(double header_deadline_s, int64_t min_rate_bytes_per_s, bool answers,
                            struct connection_table **out, struct error *err)
{
    struct connection_table *t = calloc(1, sizeof *t);
    if (t == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the table of connections: out of memory");
    pthread_mutex_init(&t->lock, NULL);
    t->header_deadline_s = header_deadline_s;
    t->answers = answers;
    t->min_rate_bytes_per_s = (double)min_rate_bytes_per_s;
    *out = t;
    return STATUS_OK;
}

void connection_table_free(struct connection_table *t)
{
    if (t == NULL) return;
    pthread_mutex_destroy(&t->lock);
    free(t);
}

size_t connection_table_count(struct connection_table *t)
{
    pthread_mutex_lock(&t->lock);
    size_t n = t->n;
    pthread_mutex_unlock(&t->lock);
    return n;
}

struct connection_entry *connection_opened(struct connection_table *t, int fd)
{
    struct connection_entry *e = calloc(1, sizeof *e);
    if (e == NULL) return NULL;
    e->fd = fd;
    e->since_s = clock_monotonic_s();
    pthread_mutex_lock(&t->lock);
    e->next = t->first;
    if (e->next != NULL) e->next->before = e;
    t->first = e;
    t->n++;
    pthread_mutex_unlock(&t->lock);
    return e;
}

/* The library calls this before it closes the socket, so while the lock is held the descriptor still belongs to this
 * connection. */
void connection_closed(struct connection_table *t, struct connection_entry *e)
{
    if (e == NULL) return;
    pthread_mutex_lock(&t->lock);
    if (e->before != NULL)
        e->before->next = e->next;
    else
        t->first = e->next;
    if (e->next != NULL) e->next->before = e->before;
    t->n--;
    pthread_mutex_unlock(&t->lock);
    free(e);
}

/* Bytes that the client's machine has acknowledged since the connection began. Returns false where the socket counts
 * none: over a unix socket, whose readers are local and have no minimum rate. */
static bool acknowledged_bytes(int fd, uint64_t *n_bytes)
{
    struct tcp_info info = {0};
    socklen_t n = sizeof info;
    *n_bytes = 0;
    if (getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &n) != 0) return false;
    *n_bytes = info.tcpi_bytes_acked;
    return true;
}

static void enter(struct connection_table *t, struct connection_entry *e, enum phase phase)
{
    if (e == NULL) return;
    pthread_mutex_lock(&t->lock);
    e->phase = phase;
    e->since_s = clock_monotonic_s();
    e->window_s = e->since_s;
    e->window_bytes = 0;
    e->memory_bytes = 0;
    if (phase == PHASE_BODY) atomic_store(&e->n_received, 0);
    if (phase == PHASE_SEND) {
        e->served = true;
        acknowledged_bytes(e->fd, &e->window_bytes);
    }
    pthread_mutex_unlock(&t->lock);
}

void connection_body_begins(struct connection_table *t, struct connection_entry *e) { enter(t, e, PHASE_BODY); }
void connection_working(struct connection_table *t, struct connection_entry *e) { enter(t, e, PHASE_WORK); }
void connection_sending(struct connection_table *t, struct connection_entry *e) { enter(t, e, PHASE_SEND); }
void connection_idle(struct connection_table *t, struct connection_entry *e) { enter(t, e, PHASE_HEAD); }

void connection_in_memory(struct connection_table *t, struct connection_entry *e, int64_t n_bytes)
{
    if (e == NULL) return;
    pthread_mutex_lock(&t->lock);
    e->memory_bytes = n_bytes;
    pthread_mutex_unlock(&t->lock);
}

void connection_received(struct connection_entry *e, size_t n_bytes)
{
    if (e == NULL) return;
    atomic_fetch_add(&e->n_received, n_bytes);
    atomic_store(&e->consuming, true);
}

void connection_stored(struct connection_entry *e)
{
    if (e != NULL) atomic_store(&e->consuming, false);
}

void connection_bind(struct connection_table *t, struct connection_entry *e, void *handle)
{
    if (e == NULL) return;
    pthread_mutex_lock(&t->lock);
    e->bound = true;
    e->thread = pthread_self();
    e->handle = handle;
    pthread_mutex_unlock(&t->lock);
}

/* Whether a connection has no thread yet, but some bytes of its first request. */
static bool begins(const struct connection_entry *e)
{
    struct tcp_info info = {0};
    socklen_t n = sizeof info;
    return !e->bound && (getsockopt(e->fd, IPPROTO_TCP, TCP_INFO, &info, &n) != 0 || info.tcpi_bytes_received > 0);
}

int connection_of_thread(struct connection_table *t, void **handle)
{
    int fd = -1, only_fd = -1;
    size_t n_beginning = 0;
    *handle = NULL;
    pthread_mutex_lock(&t->lock);
    for (struct connection_entry *e = t->first; e != NULL; e = e->next) {
        if (e->bound && pthread_equal(e->thread, pthread_self())) {
            fd = e->fd;
            *handle = e->handle;
        }
        if (!begins(e)) continue;
        n_beginning++;
        only_fd = e->fd;
    }
    pthread_mutex_unlock(&t->lock);
    return fd >= 0 || n_beginning != 1 ? fd : only_fd;
}

/* Ends the window of a connection that has moved `n` bytes so far, once the window is long enough. Returns true if too
 * few of them moved in it. */
static bool moved_few(const struct connection_table *t, struct connection_entry *e, uint64_t n, double now)
{
    double window_s = now - e->window_s;
    if (window_s < RATE_GRACE_S) return false;
    bool few = (double)(n - e->window_bytes) < t->min_rate_bytes_per_s * window_s;
    e->window_s = now;
    e->window_bytes = n;
    return few;
}

/* Whether the client sends its body too slowly: for a whole window few bytes have come, and none wait to be read. */
static bool sends_slowly(const struct connection_table *t, struct connection_entry *e, double now)
{
    int n_waiting = 0;
    if (!moved_few(t, e, atomic_load(&e->n_received), now) || atomic_load(&e->consuming)) return false;
    return ioctl(e->fd, SIOCINQ, &n_waiting) != 0 || n_waiting == 0;
}

/* Whether the client reads its answer too slowly: for a whole window bytes have waited for it, and few have gone. */
static bool reads_slowly(const struct connection_table *t, struct connection_entry *e, double now)
{
    int n_waiting = 0;
    uint64_t n;
    if (!acknowledged_bytes(e->fd, &n) || !moved_few(t, e, n, now)) return false;
    return ioctl(e->fd, SIOCOUTQ, &n_waiting) == 0 && n_waiting > 0;
}

static bool too_slow(const struct connection_table *t, struct connection_entry *e, double now)
{
    double age_s = now - e->since_s;
    /* an idle connection of a client's pool may stay open three times as long */
    if (e->phase == PHASE_HEAD) return age_s > t->header_deadline_s * (e->served ? 3 : 1);
    if (e->phase == PHASE_BODY) return sends_slowly(t, e, now);
    if (e->phase == PHASE_SEND) return reads_slowly(t, e, now);
    return false;
}

/* Returns whether the client has closed an idle connection. The library should notice that at once, but on a busy
 * machine it occasionally misses one of many that close together, which would then stay open until the deadline. */
static bool client_gone(const struct connection_entry *e, double now)
{
    struct pollfd p = {.fd = e->fd, .events = POLLRDHUP};
    return e->phase == PHASE_HEAD && now - e->since_s > GONE_GRACE_S && poll(&p, 1, 0) == 1 &&
           (p.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

/* Ends a connection, with the answer 408 if the client can understand it. t->lock is held. */
static void end(const struct connection_table *t, struct connection_entry *e, bool answers)
{
    char answer[512];
    int n_answer = snprintf(answer, sizeof answer,
                            "HTTP/1.1 408 Request Timeout\r\nContent-Type: application/problem+json\r\nConnection: "
                            "close\r\nContent-Length: %zu\r\n\r\n%s",
                            sizeof too_slow_body - 1, too_slow_body);
    e->ended = true;
    if (answers && t->answers && (e->phase == PHASE_BODY || (e->phase == PHASE_HEAD && !e->served))) {
        ssize_t n = send(e->fd, answer, (size_t)n_answer, MSG_DONTWAIT | MSG_NOSIGNAL);
        (void)n; /* the connection ends whether or not the answer arrives */
    }
    shutdown(e->fd, SHUT_RDWR);
}

void connection_table_reap(struct connection_table *t)
{
    double now = clock_monotonic_s();
    pthread_mutex_lock(&t->lock);
    for (struct connection_entry *e = t->first; e != NULL; e = e->next) {
        if (e->ended) continue;
        bool gone = client_gone(e, now);
        if (gone || too_slow(t, e, now)) end(t, e, !gone);
    }
    pthread_mutex_unlock(&t->lock);
}

void connection_table_end_late(struct connection_table *t)
{
    double now = clock_monotonic_s();
    pthread_mutex_lock(&t->lock);
    for (struct connection_entry *e = t->first; e != NULL; e = e->next) {
        double allowed_s = RATE_GRACE_S + (double)e->memory_bytes / MEAN_RATE_BYTES_PER_S;
        if (!e->ended && e->memory_bytes > 0 && now - e->since_s > allowed_s) end(t, e, true);
    }
    pthread_mutex_unlock(&t->lock);
}
