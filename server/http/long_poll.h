/* Long polls: a GET with `wait` and If-None-Match is answered when the tag is no longer the present one, or 304 after
 * `wait` seconds. Each connection has a thread, so only a thread waits that would be idle otherwise, and no other
 * request. */
#ifndef SELVEDGE_SERVER_LONG_POLL_H
#define SELVEDGE_SERVER_LONG_POLL_H

#include "server/http/http_request.h"

enum { LONG_POLL_MOST_S = 60 };

struct long_poll {
    struct change_watch *watch; /* NULL: the request does not wait */
    double until_s, seen_s, pause_s;
};

/* job_id NULL: the list of jobs. Reads `wait`; returns false after deciding another reply. Use:
 * if (!long_poll_begin(r, id, &p)) return;
 * do decide the reply; while (long_poll_again(r, &p));
 * The last call of long_poll_again releases the watch. */
bool long_poll_begin(struct http_request *request, const char *job_id, struct long_poll *poll);
bool long_poll_again(struct http_request *request, struct long_poll *poll);

#endif
