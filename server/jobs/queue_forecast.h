/* When queued jobs will probably start and end. It repeats the supervisor's choice (queue_turn.h) in advance. Running
 * jobs end after their eta_s. A queued job takes as long as its plan says (input_plan of server/workers/input_judge.h),
 * the same number that `selvedge plan` shows. A job without a plan takes as long as the planned jobs of its batch on
 * average, or the median of the jobs that succeeded last. It is computed once a second at most, so it costs little
 * however many requests ask for it. Thread-safe. */
#ifndef SELVEDGE_SERVER_QUEUE_FORECAST_H
#define SELVEDGE_SERVER_QUEUE_FORECAST_H

#include "server/jobs/job_service.h"

struct queue_forecast;

/* NULL: out of memory. */
struct queue_forecast *queue_forecast_new(void);
void queue_forecast_free(struct queue_forecast *forecast);

struct queue_place {
    int64_t position;                /* 1: the next one to start; 0: not queued, or too far behind to say */
    double start_unix_s, end_unix_s; /* rounded to half a minute; 0: unknown */
};
struct queue_place queue_forecast_of(struct job_service *v, const char *job_id);

#endif
