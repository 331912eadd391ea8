/* Long polls: a GET with `wait` and If-None-Match is answered when the tag is no longer the present one, or 304 after
 * `wait` seconds. Each connection has its own thread, so a waiting request delays no other request. */
#ifndef SELVEDGE_SERVER_LONG_POLL_H
#define SELVEDGE_SERVER_LONG_POLL_H

#include "server/http/http_request.h"

enum { LONG_POLL_MOST_S = 60 };

struct long_poll {
    struct change_watch *watch; /* NULL: the request does not wait */
    double until_s, seen_s, pause_s;
};

/* Reads `wait`. Returns false if `wait` is invalid; the reply that says so is then decided. job_id NULL: watches the
 * list of jobs. The handler decides its reply anew as long as long_poll_again returns true:
 *
 *     if (!long_poll_begin(r, id, &p)) return;
 *     do decide_reply(r);
 *     while (long_poll_again(r, &p));
 *
 * The call of long_poll_again that returns false releases the watch. */
bool long_poll_begin(struct http_request *request, const char *job_id, struct long_poll *poll);
bool long_poll_again(struct http_request *request, struct long_poll *poll);

#endif
