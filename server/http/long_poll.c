#include "server/http/long_poll.h"
#include "base/clock.h"
#include "server/http/access_guard.h"
#include "server/http/http_reply.h"
#include "server/jobs/change_feed.h"

/* Least time between two looks of one request at its job or list: a running job changes with every heartbeat, and the
 * list with the heartbeats of all jobs. */
static const double job_pause_s = 0.1, list_pause_s = 0.5;

static int socket_of(struct http_request *r)
{
    const union MHD_ConnectionInfo *info = MHD_get_connection_info(r->connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    return info == NULL ? -1 : info->connect_fd;
}

bool long_poll_begin(struct http_request *r, const char *job_id, struct long_poll *p)
{
    long long wait_s;
    struct error err = {0};
    *p = (struct long_poll){.pause_s = job_id == NULL ? list_pause_s : job_pause_s};
    if (!query_integer(r, "wait", 0, LONG_POLL_MOST_S, 0, &wait_s)) return false;
    if (wait_s == 0 || request_header(r, "If-None-Match") == NULL) return true;
    if (change_watch_begin(r->service->feed, job_id, &p->watch, &err) != STATUS_OK) {
        reply_problem(r, "no_memory", &err, NULL);
        return false;
    }
    p->seen_s = clock_monotonic_s();
    p->until_s = p->seen_s + (double)wait_s;
    return true;
}

bool long_poll_again(struct http_request *r, struct long_poll *p)
{
    if (p->watch == NULL) return false;
    if (r->reply_status == MHD_HTTP_NOT_MODIFIED) {
        int fd = socket_of(r);
        enum change_wake woken = change_watch_wait(p->watch, fd, p->until_s);
        /* a change soon after the last look waits for others that come with it */
        double next_s = p->seen_s + p->pause_s;
        while (woken == CHANGE_SEEN && clock_monotonic_s() < next_s) {
            woken = change_watch_wait(p->watch, fd, next_s);
            if (woken == CHANGE_NONE) woken = CHANGE_SEEN;
        }
        p->seen_s = clock_monotonic_s();
        if (woken == CHANGE_SEEN && guard_access_still(r)) return true;
    }
    change_watch_end(p->watch);
    p->watch = NULL;
    return false;
}
