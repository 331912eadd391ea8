/* Paths under the data folder.
 * The data folder has selvedge.db, lock, daemon.json, removed.rec (retention.h), jobs/<id>/, trash/<id>,
 * quarantine/<name>-<time> and new/<batch>/<id>, the folders of jobs that a batch is about to make. The folder of a job
 * has, beside the files that job_folder.h names, upload/<upload id> (incomplete inputs), kept (job_keep.h) and
 * console.txt (stdout and stderr of the last attempt). */
#ifndef SELVEDGE_SERVER_JOB_PATHS_H
#define SELVEDGE_SERVER_JOB_PATHS_H

#include "base/status.h"

#include <stdbool.h>

enum { PATH_BYTES = 4096 };

/* Joins parts with '/': path_join(out, "data", "jobs", id, NULL). A longer path would be cut, but settings and ids
 * are short enough for all paths. */
void path_join(char out[PATH_BYTES], const char *first, ...) __attribute__((sentinel));
/* Bytes of a file system that are free for this user. */
status path_free_bytes(const char *path, long long *free_bytes, struct error *err);
/* Whether id is 8-4-4-4-12 lower-case hexadecimal digits. */
bool id_valid(const char *id);

#endif
