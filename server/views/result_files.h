/* The files of a job's results: their list, their JSON (ResultFile in config/openapi.json), and their bytes. */
#ifndef SELVEDGE_SERVER_RESULT_FILES_H
#define SELVEDGE_SERVER_RESULT_FILES_H

#include "server/jobs/job_service.h"

enum { RESULT_MAX_FILE = 20000, RESULT_MAX_DEPTH = 6, RESULT_PATH_BYTES = 512 };

struct result_file {
    char path[RESULT_PATH_BYTES]; /* relative to results/; components of [A-Za-z0-9._-] that do not start with a dot */
    long long size_bytes;
    double modified_unix_s;
};
/* Lists the regular files under a folder of the job (JOB_FOLDER_RESULTS, or the folder of a version), sorted by path,
 * without links and files whose names have other characters. The caller frees *file. STATUS_TOO_LARGE: there are more
 * than RESULT_MAX_FILE, and only these are listed. */
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
