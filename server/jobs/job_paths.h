/* Where things are under the data folder, and removal of whole folders without following links.
 *   selvedge.db  lock  daemon.json  jobs/<id>/  trash/<id>  quarantine/<name>-<time>
 * In a job's folder, beside what job_folder.h names: upload/<upload id> (inputs that are not complete), console.txt (stdout and
 * stderr of the last attempt). */
#ifndef SELVEDGE_SERVER_JOB_PATHS_H
#define SELVEDGE_SERVER_JOB_PATHS_H

#include "base/status.h"

#include <stdbool.h>

enum { PATH_BYTES = 4096 };

/* Join with '/': path_join(out, "data", "jobs", id, NULL). An over-long path is cut and path_ok() is false for it;
 * settings and ids are short enough that it does not happen. */
void path_join(char out[PATH_BYTES], const char *first, ...) __attribute__((sentinel));
/* rm -r; what does not exist is fine. Never leaves the folder (links are removed, not followed). */
status path_remove_tree(const char *path, struct error *err);
/* Bytes that a file system has free for this user. */
status path_free_bytes(const char *path, long long *free_bytes, struct error *err);
/* 8-4-4-4-12 lower-case hexadecimal */
bool id_valid(const char *id);

#endif
