/* The JSON of jobs and their input files, as docs/api.md describes it. */
#ifndef SELVEDGE_SERVER_JOB_VIEW_H
#define SELVEDGE_SERVER_JOB_VIEW_H

#include "server/jobs/job_service.h"

enum { JOB_TAG_BYTES = 40 };

/* full: with document (which the row must hold then), files, missing files and result_url. heartbeat_age_s is null; the
 * caller sets it with job_view_heartbeat_age. */
status job_view(struct job_service *v, const struct job_row *row, bool full, json_t **view, struct error *err);
/* The strong ETag, with its quotes, of the full view but heartbeat_age_s. Its cost grows neither with the document nor
 * with the files and the result; the row needs no document. */
status job_view_tag(struct job_service *v, const struct job_row *row, char tag[JOB_TAG_BYTES], struct error *err);
/* That of job_view_files. */
void job_view_files_tag(struct job_service *v, const struct job_row *row, char tag[JOB_TAG_BYTES]);
/* Returns the seconds since the last heartbeat of the present attempt, or JSON null. */
json_t *job_view_heartbeat_age(struct job_service *v, const struct job_row *row);
json_t *file_view(const struct file_row *row);
/* {"files":[...],"missing_files":[...]} */
status job_view_files(struct job_service *v, const struct job_row *row, json_t **view, struct error *err);

#endif
