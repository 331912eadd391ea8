#include "server/settings/job_paths.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/statvfs.h>
#include <unistd.h>

void path_join(char out[PATH_BYTES], const char *first, ...)
{
    size_t n = (size_t)snprintf(out, PATH_BYTES, "%s", first);
    va_list args;
    va_start(args, first);
    for (const char *part; (part = va_arg(args, const char *)) != NULL && n < PATH_BYTES;)
        n += (size_t)snprintf(out + n, PATH_BYTES - n, "/%s", part);
    va_end(args);
}

status path_free_bytes(const char *path, long long *free_bytes, struct error *err)
{
    struct statvfs fs;
    if (statvfs(path, &fs) != 0) return error_set_errno(err, "cannot examine '%s'", path);
    *free_bytes = (long long)fs.f_bavail * (long long)fs.f_frsize;
    return STATUS_OK;
}

bool id_valid(const char *id)
{
    for (int i = 0; i < 36; i++) {
        bool dash = i == 8 || i == 13 || i == 18 || i == 23;
        if (dash ? id[i] != '-' : !((id[i] >= '0' && id[i] <= '9') || (id[i] >= 'a' && id[i] <= 'f'))) return false;
    }
    return id[36] == '\0';
}
