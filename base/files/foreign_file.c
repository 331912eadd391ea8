#include "base/files/foreign_file.h"
#include "base/files/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

static status missing(const char *folder, const char *name, struct error *err)
{
    return error_set(err, STATUS_NOT_FOUND, "cannot read '%s' in '%s': there is no such file", name, folder);
}

/* Opens the next part of *name within a folder, whose descriptor is closed, and moves *name behind it. -1: errno. */
static int open_part(int folder_fd, const char **name)
{
    char part[NAME_MAX + 1];
    const size_t n = strcspn(*name, "/");
    int fd = -1, saved;
    errno = ENAMETOOLONG;
    if (n < sizeof part) {
        const bool last = (*name)[n] == '\0';
        memcpy(part, *name, n);
        part[n] = '\0';
        fd = openat(folder_fd, part, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC | (last ? 0 : O_DIRECTORY));
        *name += n + (last ? 0 : 1);
    }
    saved = errno;
    close(folder_fd);
    errno = saved;
    return fd;
}

status foreign_file_open(const char *folder, const char *name, int *fd, uint64_t *size, struct error *err)
{
    struct stat st;
    const char *rest = name;
    int at = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    while (at >= 0 && *rest != '\0') at = open_part(at, &rest);
    if (at < 0 && (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == EIO))
        return error_set_errno(err, "cannot read '%s' in '%s'", name, folder);
    if (at < 0) return missing(folder, name, err);
    if (fstat(at, &st) != 0 || !S_ISREG(st.st_mode)) {
        close(at);
        return missing(folder, name, err);
    }
    if (size != NULL) *size = (uint64_t)st.st_size;
    *fd = at;
    return STATUS_OK;
}

status foreign_file_read(const char *folder, const char *name, size_t limit_bytes, char **data, size_t *n_bytes,
                         struct error *err)
{
    uint64_t size = 0;
    size_t used = 0;
    int fd = -1;
    status s = foreign_file_open(folder, name, &fd, &size, err);
    if (s != STATUS_OK) return s;
    char *text = size <= limit_bytes ? malloc((size_t)size + 1) : NULL;
    if (size > limit_bytes)
        s = error_set(err, STATUS_TOO_LARGE, "cannot read '%s' in '%s': %llu bytes, the limit is %zu", name, folder,
                      (unsigned long long)size, limit_bytes);
    else if (text == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot read '%s' in '%s': out of memory", name, folder);
    while (s == STATUS_OK && used < size) {
        ssize_t n = read(fd, text + used, (size_t)size - used);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) s = error_set_errno(err, "cannot read '%s' in '%s'", name, folder);
        if (n <= 0) break; /* it has become shorter meanwhile */
        used += (size_t)n;
    }
    close(fd);
    if (s != STATUS_OK) {
        free(text);
        return s;
    }
    text[used] = '\0';
    *data = text;
    if (n_bytes != NULL) *n_bytes = used;
    return STATUS_OK;
}

status foreign_file_clear(const char *path, struct error *err)
{
    char aside[PATH_MAX];
    uint32_t random = 0;
    struct stat st;
    if (lstat(path, &st) != 0 || S_ISREG(st.st_mode)) return STATUS_OK;
    if (!S_ISDIR(st.st_mode))
        return unlink(path) == 0 || errno == ENOENT ? STATUS_OK : error_set_errno(err, "cannot remove '%s'", path);
    if (getrandom(&random, sizeof random, 0) != (ssize_t)sizeof random) random = 0;
    snprintf(aside, sizeof aside, "%s.folder-%08x", path, (unsigned)random);
    return rename(path, aside) == 0 ? STATUS_OK : error_set_errno(err, "cannot rename the folder '%s'", path);
}

status foreign_file_replace(const char *path, const void *data, size_t n_bytes, bool sync, struct error *err)
{
    status s = foreign_file_clear(path, err);
    if (s != STATUS_OK) return s;
    return sync ? durable_replace(path, data, n_bytes, err) : durable_replace_volatile(path, data, n_bytes, err);
}

status foreign_folder_clear(const char *path, struct error *err)
{
    struct stat st;
    if (lstat(path, &st) != 0 || S_ISDIR(st.st_mode)) return STATUS_OK;
    return unlink(path) == 0 || errno == ENOENT ? STATUS_OK : error_set_errno(err, "cannot remove '%s'", path);
}
