/* Names of input files. */
#ifndef SELVEDGE_OPTIMIZER_JOB_FILE_NAME_H
#define SELVEDGE_OPTIMIZER_JOB_FILE_NAME_H

#include "base/status.h"
#include "optimizer/job/document/job_limits.h"

#include <stdbool.h>

/* True for UTF-8 of 1..127 bytes without '/', '\\' and control characters, not starting with '.'. */
bool job_file_name_valid(const char *name);
/* Makes a plain file name of any text: bytes outside of [A-Za-z0-9._-] become '_', and it is cut to 127 bytes. */
void job_file_name_make_valid(const char *text, char name[JOB_MAX_NAME_BYTES]);
/* Returns STATUS_INVALID with the key `path` when job_file_name_valid is false. */
status job_check_file_name(const char *path, const char *name, struct error *err);

#endif
