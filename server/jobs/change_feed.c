#include "server/jobs/change_feed.h"
#include "base/clock.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

enum { ID_BYTES = 40 };

struct change_watch {
    struct change_feed *feed;
    struct change_watch *next, *before; /* guarded by feed->lock */
    char job_id[ID_BYTES];              /* "": the list */
    int fd;                             /* readable once something was published */
};

struct change_feed {
    pthread_mutex_t lock;
    struct change_watch *first;
};

status change_feed_new(struct change_feed **out, struct error *err)
{
    struct change_feed *f = calloc(1, sizeof *f);
    if (f == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot start: out of memory");
    pthread_mutex_init(&f->lock, NULL);
    *out = f;
    return STATUS_OK;
}

void change_feed_free(struct change_feed *f)
{
    if (f == NULL) return;
    pthread_mutex_destroy(&f->lock);
    free(f);
}

static void wake(const struct change_watch *w)
{
    uint64_t one = 1;
    ssize_t n = write(w->fd, &one, sizeof one);
    (void)n; /* it fails only when the counter is full, and then the watch is awake */
}

void change_feed_publish(struct change_feed *f, const char *job_id)
{
    pthread_mutex_lock(&f->lock);
    for (struct change_watch *w = f->first; w != NULL; w = w->next)
        if (job_id == NULL || w->job_id[0] == '\0' || strcmp(w->job_id, job_id) == 0) wake(w);
    pthread_mutex_unlock(&f->lock);
}

status change_watch_begin(struct change_feed *f, const char *job_id, struct change_watch **out, struct error *err)
{
    struct change_watch *w = calloc(1, sizeof *w);
    if (w == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot wait for a change: out of memory");
    w->feed = f;
    w->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (w->fd < 0) {
        free(w);
        return error_set_errno(err, "cannot wait for a change");
    }
    snprintf(w->job_id, sizeof w->job_id, "%s", job_id == NULL ? "" : job_id);
    pthread_mutex_lock(&f->lock);
    w->next = f->first;
    if (w->next != NULL) w->next->before = w;
    f->first = w;
    pthread_mutex_unlock(&f->lock);
    *out = w;
    return STATUS_OK;
}

void change_watch_end(struct change_watch *w)
{
    if (w == NULL) return;
    pthread_mutex_lock(&w->feed->lock);
    if (w->before != NULL)
        w->before->next = w->next;
    else
        w->feed->first = w->next;
    if (w->next != NULL) w->next->before = w->before;
    pthread_mutex_unlock(&w->feed->lock);
    close(w->fd);
    free(w);
}

enum change_wake change_watch_wait(struct change_watch *w, int socket_fd, double until_s)
{
    struct pollfd p[2] = {{.fd = w->fd, .events = POLLIN}, {.fd = socket_fd, .events = POLLRDHUP}};
    for (;;) {
        double left_s = until_s - clock_monotonic_s();
        if (left_s <= 0) return CHANGE_NONE;
        int n = poll(p, 2, (int)ceil(fmin(left_s, 3600) * 1000));
        if (n < 0 && errno != EINTR) return CHANGE_NO_PEER;
        if (n <= 0) continue;
        if (p[1].revents != 0) return CHANGE_NO_PEER;
        uint64_t count;
        if (read(w->fd, &count, sizeof count) == sizeof count) return CHANGE_SEEN;
    }
}
