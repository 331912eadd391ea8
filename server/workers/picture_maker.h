/* The stage after the result. A job that has succeeded is put on a list; while no job waits or runs, a thread starts
 * the worker once more on its folder, to make its picture in the studio and its twin (worker option --pictures), one
 * job after the other. A job that is queued stops it; the worker goes on later from its checkpoints. The job itself
 * stays as it is: progress is in JOB/pictures.json alone.
 *
 * The list is a folder, DATA/pictures, with an empty file for each job, so it outlives the daemon. With workers of an
 * engine (jobs.backend) nothing is put on it.
 */
#ifndef SELVEDGE_SERVER_PICTURE_MAKER_H
#define SELVEDGE_SERVER_PICTURE_MAKER_H

#include "server/jobs/job_service.h"

struct picture_maker;
/* *maker is NULL where jobs.pictures is off. STATUS_IO, STATUS_NO_MEMORY. */
status picture_maker_start(struct job_service *service, struct picture_maker **maker, struct error *err);
/* Ends the worker and joins the thread, after service->stopping has been set. NULL is accepted. */
void picture_maker_stop(struct picture_maker *maker);

/* Puts a job that has succeeded on the list, if jobs.pictures is on, and writes the state "waiting" to its
 * pictures.json. A failure is a line of the log. */
void picture_list_add(struct job_service *service, const char *job_id);
/* Takes a job off the list: a worker that makes its pictures ends, and what it has made stays. */
void picture_list_remove(struct job_service *service, const char *job_id);
/* Returns {"state", "fraction", "error"} of the stage (docs/api.md), owned by the caller. */
json_t *picture_list_view(struct job_service *service, const char *job_id);
/* Whether the settings let pictures be made. */
bool picture_list_exists(const struct job_service *service);

#endif
