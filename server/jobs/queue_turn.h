/* Whose turn it is when a worker is free. Among owners: who has the fewest running jobs; among equals, whose last job
 * was started longest ago; among those, whose job has waited longest. Within an owner the highest priority comes first,
 * and then the owner's batches take turns by the same rule (jobs without a batch count as one batch). Within a batch:
 * by priority, then first come. The supervisor starts jobs by this rule, and the forecast repeats it in advance. */
#ifndef SELVEDGE_SERVER_QUEUE_TURN_H
#define SELVEDGE_SERVER_QUEUE_TURN_H

#include "server/store/store.h"

struct queue_turn;

/* job: as store_job_queue lists them; they must outlive the turn. NULL: out of memory. */
struct queue_turn *queue_turn_new(const struct queued_job *job, size_t n);
void queue_turn_free(struct queue_turn *turn);
/* Passes over a job. */
void queue_turn_skip(struct queue_turn *turn, size_t i_job);
/* A job of this owner and batch runs, or does not run any more (n: 1, -1). */
void queue_turn_running(struct queue_turn *turn, const char *owner, const char *batch, int n);
/* Returns the job whose turn it is, passes over it and notes that it was started at that time; or n, when none is left.
 * It does not count as running yet. */
size_t queue_turn_next(struct queue_turn *turn, double now_unix_s);

#endif
