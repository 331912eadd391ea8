/* The thread that plans jobs while they wait in the queue, one after the other, so that the forecast of the queue
 * (server/jobs/queue_forecast.h) knows how long each will take. A job that starts at once needs no plan: its worker
 * makes the same forecast. */
#ifndef SELVEDGE_SERVER_QUEUE_PLANNER_H
#define SELVEDGE_SERVER_QUEUE_PLANNER_H

#include "server/jobs/job_service.h"

struct queue_planner;
/* *planner is NULL where jobs.plan_queued is off. STATUS_IO, STATUS_NO_MEMORY. */
status queue_planner_start(struct job_service *service, struct queue_planner **planner, struct error *err);
/* Joins the thread, after service->stopping has been set. NULL is accepted. */
void queue_planner_stop(struct queue_planner *planner);

#endif
