/* The JSON of jobs, files and result listings, as docs/api.md describes it. */
#ifndef SELVEDGE_SERVER_JOB_VIEW_H
#define SELVEDGE_SERVER_JOB_VIEW_H

#include "server/jobs/job_service.h"

enum { RESULT_MAX_FILE = 20000, RESULT_MAX_DEPTH = 6, RESULT_PATH_BYTES = 512, JOB_TAG_BYTES = 40 };

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

struct result_file {
    char path[RESULT_PATH_BYTES]; /* relative to results/; components of [A-Za-z0-9._-] that do not start with a dot */
    long long size_bytes;
    double modified_unix_s;
};
/* Lists the regular files under a folder of the job (JOB_FOLDER_RESULTS, or that of a version), sorted by path, without
 * links and files whose names have other characters. The caller frees *file. STATUS_TOO_LARGE: there are more than
 * RESULT_MAX_FILE, of which so many are listed. */
status result_list(struct job_service *v, const char *job_id, const char *folder, struct result_file **file, size_t *n,
                   struct error *err);
/* Opens a listed file without following links. STATUS_NOT_FOUND for anything else. */
status result_open(struct job_service *v, const char *job_id, const char *folder, const char *path, int *fd,
                   struct error *err);
/* ResultFile of config/openapi.json for n files, whose addresses begin with `root`. */
json_t *result_files_json(const struct result_file *file, size_t n, const char *root);
/* Returns the content type for the ending of a name, by default "application/octet-stream". */
const char *content_type_of(const char *name);

#endif
