/* Wakes requests that wait for a change of a job or of the list of jobs. Each request waits on its own descriptor, so a
 * change of a job wakes only the requests that watch this job or the list. All functions are thread-safe. */
#ifndef SELVEDGE_SERVER_CHANGE_FEED_H
#define SELVEDGE_SERVER_CHANGE_FEED_H

#include "base/status.h"

struct change_feed;
struct change_watch;

/* STATUS_NO_MEMORY. */
status change_feed_new(struct change_feed **feed, struct error *err);
/* No watch may be left. */
void change_feed_free(struct change_feed *feed);
/* Wakes the watches of the job and of the list; job_id NULL: all watches. */
void change_feed_publish(struct change_feed *feed, const char *job_id);

/* Begins to watch a job (NULL: the list of jobs): changes that are published from now on end the next wait.
 * STATUS_NO_MEMORY, STATUS_IO when there is no free descriptor. */
status change_watch_begin(struct change_feed *feed, const char *job_id, struct change_watch **watch, struct error *err);
void change_watch_end(struct change_watch *watch); /* NULL is accepted */

enum change_wake {
    CHANGE_SEEN,   /* something was published since the last wait, or since the watch began */
    CHANGE_NONE,   /* the time is over */
    CHANGE_NO_PEER /* the other end of socket_fd has closed it */
};
/* Waits for a change until the monotonic time until_s. Uses no processor time meanwhile. */
enum change_wake change_watch_wait(struct change_watch *watch, int socket_fd, double until_s);

#endif
