/* Earlier results of a job that was edited and run again. Run n of a job is its n-th fresh start (job_row.generation);
 * the version of that number is its result. Before the next run clears the folder, JOB/results gets a version.json and
 * becomes JOB/versions/<n> by one rename, so a daemon that is killed has it in the one place or in the other. */
#ifndef SELVEDGE_SERVER_RESULT_VERSION_H
#define SELVEDGE_SERVER_RESULT_VERSION_H

#include "server/jobs/job_service.h"

enum { VERSION_FOLDER_BYTES = 48 };

/* Keeps the result of an edited job, if it has one, and removes the oldest versions beyond jobs.keep_versions. It may
 * be repeated after a failure or a kill. row->generation rises if versions of that number and above exist already,
 * as after the database was restored from a backup. STATUS_IO, STATUS_DISK_FULL. */
status version_keep(struct job_service *v, struct job_row *row, struct error *err);

/* {"versions":[...]}: kept versions and the present result, the oldest first. The row needs its document. */
status version_list(struct job_service *v, const struct job_row *row, json_t **view, struct error *err);
/* One of them, with document and files. STATUS_NOT_FOUND. */
status version_view(struct job_service *v, const struct job_row *row, const char *number, json_t **view,
                    struct error *err);
/* Opens a file of a version. STATUS_NOT_FOUND. */
status version_open(struct job_service *v, const struct job_row *row, const char *number, const char *path, int *fd,
                    struct error *err);

#endif
