#include "server/jobs/job_paths.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
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

static int remove_entries(int folder_fd, int depth);

/* Removes an entry of a folder; returns 0 or errno. */
static int remove_entry(int folder_fd, const char *name, int depth)
{
    if (unlinkat(folder_fd, name, 0) == 0 || errno == ENOENT) return 0;
    if (errno != EISDIR && errno != EPERM) return errno;
    int fd = openat(folder_fd, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) return errno == ENOENT ? 0 : errno;
    int e = remove_entries(fd, depth + 1);
    if (e != 0) return e;
    return unlinkat(folder_fd, name, AT_REMOVEDIR) == 0 || errno == ENOENT ? 0 : errno;
}

/* Takes ownership of folder_fd. */
static int remove_entries(int folder_fd, int depth)
{
    DIR *d = fdopendir(folder_fd);
    if (d == NULL) {
        int e = errno;
        close(folder_fd);
        return e;
    }
    int e = depth > 64 ? ELOOP : 0;
    for (struct dirent *entry; e == 0 && (entry = readdir(d)) != NULL;) {
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0) continue;
        e = remove_entry(dirfd(d), entry->d_name, depth);
    }
    closedir(d);
    return e;
}

status path_remove_tree(const char *path, struct error *err)
{
    int e = remove_entry(AT_FDCWD, path, 0);
    if (e == 0) return STATUS_OK;
    errno = e;
    return error_set_errno(err, "cannot remove '%s'", path);
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
