#include "optimizer/job/document/job_file_name.h"

#include <stdio.h>
#include <string.h>

static const char name_allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";

bool job_file_name_valid(const char *name)
{
    size_t n = strlen(name);
    if (n == 0 || n >= JOB_MAX_NAME_BYTES || name[0] == '.') return false;
    return strspn(name, name_allowed) == n;
}

void job_file_name_make_valid(const char *text, char name[JOB_MAX_NAME_BYTES])
{
    snprintf(name, JOB_MAX_NAME_BYTES, "%s", text);
    if (name[0] == '.' || name[0] == '\0') snprintf(name, JOB_MAX_NAME_BYTES, "_%s", text[0] != '\0' ? text + 1 : "");
    for (char *p = name + strspn(name, name_allowed); *p != '\0'; p += strspn(p, name_allowed)) *p = '_';
}

status job_check_file_name(const char *path, const char *name, struct error *err)
{
    if (job_file_name_valid(name)) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, path,
        "'%s' is '%.140s': a file name has 1 to %d characters out of A-Z a-z 0-9 . _ - and does not start with a dot",
        path, name, JOB_MAX_NAME_BYTES - 1);
}
