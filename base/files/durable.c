#include "base/files/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum { RECORD_BUFFER_BYTES = 32 << 10 };

static status too_long(const char *path, struct error *err)
{
    return error_set(err, STATUS_INVALID, "path '%.100s...' is too long", path);
}

const char *path_file_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash != NULL && slash[1] != '\0' ? slash + 1 : path;
}

static status write_all(int fd, const char *data, size_t n_bytes)
{
    while (n_bytes > 0) {
        ssize_t n = write(fd, data, n_bytes);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) return STATUS_IO;
        data += n;
        n_bytes -= (size_t)n;
    }
    return STATUS_OK;
}

status durable_sync_folder_of(const char *path, struct error *err)
{
    char folder[4096];
    int n = snprintf(folder, sizeof folder, "%s", path);
    if (n < 0 || (size_t)n >= sizeof folder) return too_long(path, err);
    char *slash = strrchr(folder, '/');
    if (slash == NULL)
        snprintf(folder, sizeof folder, ".");
    else if (slash == folder)
        folder[1] = '\0';
    else
        *slash = '\0';
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return error_set_errno(err, "cannot open folder '%s'", folder);
    status s = STATUS_OK;
    if (fsync(fd) != 0 && errno != EINVAL) s = error_set_errno(err, "cannot sync folder '%s'", folder);
    close(fd);
    return s;
}

static status sync_file(const char *path, struct error *err)
{
    status s = STATUS_OK;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0 || fsync(fd) != 0) s = error_set_errno(err, "cannot sync '%s'", path);
    if (fd >= 0) close(fd);
    return s;
}

status durable_rename(const char *temporary, const char *path, struct error *err)
{
    status s = sync_file(temporary, err);
    if (s == STATUS_OK && rename(temporary, path) != 0) s = error_set_errno(err, "cannot write '%s'", path);
    if (s != STATUS_OK) {
        unlink(temporary);
        return s;
    }
    return durable_sync_folder_of(path, err);
}

static status replace(const char *path, const void *data, size_t n_bytes, bool sync, struct error *err)
{
    char temporary[4096];
    int n = snprintf(temporary, sizeof temporary, "%s.tmp-XXXXXX", path);
    if (n < 0 || (size_t)n >= sizeof temporary) return too_long(path, err);
    int fd = mkostemp(temporary, O_CLOEXEC);
    if (fd < 0) return error_set_errno(err, "cannot write '%s'", path);
    status s = STATUS_OK;
    if (write_all(fd, data, n_bytes) != STATUS_OK || (sync && fsync(fd) != 0))
        s = error_set_errno(err, "cannot write '%s'", path);
    if (close(fd) != 0 && s == STATUS_OK) s = error_set_errno(err, "cannot write '%s'", path);
    if (s == STATUS_OK && rename(temporary, path) != 0) s = error_set_errno(err, "cannot replace '%s'", path);
    if (s != STATUS_OK) {
        unlink(temporary);
        return s;
    }
    return sync ? durable_sync_folder_of(path, err) : STATUS_OK;
}

status durable_replace(const char *path, const void *data, size_t n_bytes, struct error *err)
{
    return replace(path, data, n_bytes, true, err);
}

status durable_replace_volatile(const char *path, const void *data, size_t n_bytes, struct error *err)
{
    return replace(path, data, n_bytes, false, err);
}

status durable_make_folder(const char *path, struct error *err)
{
    char part[4096];
    int n = snprintf(part, sizeof part, "%s", path);
    if (n < 0 || (size_t)n >= sizeof part) return too_long(path, err);
    if (n == 0) return error_set(err, STATUS_INVALID, "cannot make folder '': it has no name");
    for (char *c = part + 1;; c++) {
        if (*c != '/' && *c != '\0') continue;
        char end = *c;
        *c = '\0';
        struct stat st;
        if (mkdir(part, 0700) != 0 && errno != EEXIST) return error_set_errno(err, "cannot make folder '%s'", part);
        if (stat(part, &st) != 0 || !S_ISDIR(st.st_mode))
            return error_set(err, STATUS_EXISTS, "cannot make folder '%s': a file of that name is in the way", part);
        *c = end;
        if (end == '\0') return STATUS_OK;
    }
}

status file_read_all(const char *path, size_t limit_bytes, char **data, size_t *n_bytes, struct error *err)
{
    status s = STATUS_OK;
    char *buffer = NULL;
    /* O_NONBLOCK: opening a pipe must not wait; it is refused below */
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) return error_set_errno(err, "cannot read '%s'", path);
    struct stat st;
    if (fstat(fd, &st) != 0) {
        s = error_set_errno(err, "cannot read '%s'", path);
        goto out;
    }
    if (!S_ISREG(st.st_mode)) {
        s = error_set(err, STATUS_INVALID, "cannot read '%s': not a file", path);
        goto out;
    }
    if ((uint64_t)st.st_size > limit_bytes) {
        s = error_set(err, STATUS_TOO_LARGE, "cannot read '%s': %lld bytes, the limit is %zu", path,
                      (long long)st.st_size, limit_bytes);
        goto out;
    }
    size_t size = (size_t)st.st_size, used = 0;
    buffer = malloc(size + 1);
    if (buffer == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", path);
        goto out;
    }
    while (used < size) {
        ssize_t n = read(fd, buffer + used, size - used);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            s = error_set_errno(err, "cannot read '%s'", path);
            goto out;
        }
        if (n == 0) break;
        used += (size_t)n;
    }
    buffer[used] = '\0';
    *data = buffer;
    if (n_bytes != NULL) *n_bytes = used;
    buffer = NULL;
out:
    free(buffer);
    close(fd);
    return s;
}

status record_append(const char *path, const char *json, bool sync, struct error *err)
{
    size_t n_json = strlen(json);
    if (n_json == 0 || strchr(json, '\n') != NULL)
        return error_set(err, STATUS_INVALID, "cannot append to '%s': a record is one line of text", path);
    if (n_json + 10 > RECORD_MOST_BYTES)
        return error_set(err, STATUS_TOO_LARGE, "cannot append to '%s': a record of %zu bytes is too long", path,
                         n_json);
    char *line = malloc(n_json + 16);
    if (line == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot append to '%s': out of memory", path);
    unsigned long sum = crc32(0, (const unsigned char *)json, (unsigned)n_json);
    int n = snprintf(line, n_json + 16, "%08lx %s\n", sum, json);
    status s = STATUS_OK;
    int fd = open(path, O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0600);
    off_t before = -1;
    if (fd < 0) {
        s = error_set_errno(err, "cannot append to '%s'", path);
        goto out;
    }
    before = lseek(fd, 0, SEEK_END);
    if (write_all(fd, line, (size_t)n) != STATUS_OK || (sync && fdatasync(fd) != 0)) {
        s = error_set_errno(err, "cannot append to '%s'", path);
        if (before >= 0 && ftruncate(fd, before) != 0) { /* the checksum identifies an incomplete record */
        }
    } else if (sync && before == 0) {
        s = durable_sync_folder_of(path, err);
    }
out:
    if (fd >= 0) close(fd);
    free(line);
    return s;
}

static bool record_valid(const char *line, size_t n)
{
    if (n < 10 || line[8] != ' ') return false;
    char want[16]; /* compared as text, because strtoul would also accept blanks, signs and capital letters */
    snprintf(want, sizeof want, "%08lx", crc32(0, (const unsigned char *)line + 9, (unsigned)(n - 9)));
    return memcmp(line, want, 8) == 0;
}

/* Lines of a record file, from an offset on. The file may be foreign: one that is no regular file counts as missing,
 * and a line longer than a record may be counts as damaged. */
struct record_lines {
    int fd;
    uint64_t offset; /* of the first byte behind those in the buffer */
    char *buffer;
    size_t capacity, begin, end;
    int errno_value; /* of a read that failed */
    bool no_memory;
};

static status lines_open(struct record_lines *l, const char *path, uint64_t *size, struct error *err)
{
    struct stat st;
    *l = (struct record_lines){.fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)};
    if (l->fd < 0 && errno != ELOOP && errno != ENXIO) return error_set_errno(err, "cannot read '%s'", path);
    if (l->fd >= 0 && fstat(l->fd, &st) == 0 && S_ISREG(st.st_mode)) {
        *size = (uint64_t)st.st_size;
        return STATUS_OK;
    }
    if (l->fd >= 0) close(l->fd);
    return error_set(err, STATUS_NOT_FOUND, "cannot read '%s': not a file", path);
}

static void lines_seek(struct record_lines *l, uint64_t offset)
{
    l->offset = offset;
    l->begin = l->end = 0;
}

/* Makes room in the buffer, and reads into it. Returns false at the end of the file or on failure. */
static bool lines_fill(struct record_lines *l)
{
    if (l->begin > 0) memmove(l->buffer, l->buffer + l->begin, l->end - l->begin);
    l->end -= l->begin;
    l->begin = 0;
    if (l->end == l->capacity) {
        size_t more = l->capacity == 0 ? RECORD_BUFFER_BYTES : 2 * l->capacity;
        char *grown = realloc(l->buffer, more);
        l->no_memory = grown == NULL;
        if (grown == NULL) return false;
        l->buffer = grown;
        l->capacity = more;
    }
    ssize_t n;
    do n = pread(l->fd, l->buffer + l->end, l->capacity - l->end, (off_t)l->offset);
    while (n < 0 && errno == EINTR);
    if (n < 0) l->errno_value = errno;
    if (n <= 0) return false;
    l->end += (size_t)n;
    l->offset += (uint64_t)n;
    return true;
}

/* The next line with its newline, of *n bytes, until the next call; NULL if there is no whole line that is short enough
 * for a record. */
static char *lines_next(struct record_lines *l, size_t *n)
{
    for (size_t looked = 0;;) {
        const char *from = l->buffer + l->begin, *newline = NULL;
        const size_t held = l->end - l->begin;
        if (held > looked) newline = memchr(from + looked, '\n', held - looked);
        if (newline != NULL) {
            *n = (size_t)(newline - from) + 1;
            l->begin += *n;
            return *n <= RECORD_MOST_BYTES ? l->buffer + l->begin - *n : NULL;
        }
        looked = held;
        if (held >= RECORD_MOST_BYTES || !lines_fill(l)) return NULL;
    }
}

static status lines_close(struct record_lines *l, const char *path, struct error *err)
{
    free(l->buffer);
    close(l->fd);
    if (l->no_memory) return error_set(err, STATUS_NO_MEMORY, "cannot read '%s': out of memory", path);
    errno = l->errno_value;
    return errno == 0 ? STATUS_OK : error_set_errno(err, "cannot read '%s'", path);
}

status record_read(const char *path, uint64_t from, record_visitor visit, void *context, uint64_t *next,
                   struct error *err)
{
    struct record_lines l;
    uint64_t size;
    size_t n;
    status s = lines_open(&l, path, &size, err);
    if (s != STATUS_OK) return s;
    lines_seek(&l, from);
    for (char *line; (line = lines_next(&l, &n)) != NULL && record_valid(line, n - 1);) {
        line[n - 1] = '\0';
        from += (uint64_t)n;
        if (!visit(context, line + 9, n - 10)) break;
    }
    if (next != NULL) *next = from;
    return lines_close(&l, path, err);
}

enum { SEEK_SPAN_BYTES = 64 * 1024 };

/* Finds the first record that begins after offset `at`: *begin is its offset. Returns true if it is valid and
 * `before` holds for it. */
static bool record_behind(struct record_lines *l, uint64_t at, record_visitor before, void *context, uint64_t *begin)
{
    size_t rest, n;
    lines_seek(l, at);
    if (lines_next(l, &rest) == NULL) return false;
    *begin = at + rest;
    char *line = lines_next(l, &n);
    if (line == NULL || !record_valid(line, n - 1)) return false;
    line[n - 1] = '\0';
    return before(context, line + 9, n - 10);
}

status record_seek(const char *path, record_visitor before, void *context, uint64_t *from, struct error *err)
{
    struct record_lines l;
    uint64_t end;
    *from = 0;
    status s = lines_open(&l, path, &end, err);
    if (s != STATUS_OK) return s;
    while (end - *from > SEEK_SPAN_BYTES && l.errno_value == 0 && !l.no_memory) {
        uint64_t middle = *from + (end - *from) / 2, begin = 0;
        if (record_behind(&l, middle, before, context, &begin) && begin < end)
            *from = begin;
        else
            end = middle;
    }
    return lines_close(&l, path, err);
}

status record_truncate(const char *path, uint64_t keep_bytes, struct error *err)
{
    struct stat st;
    if (stat(path, &st) != 0) return errno == ENOENT ? STATUS_OK : error_set_errno(err, "cannot examine '%s'", path);
    if ((uint64_t)st.st_size <= keep_bytes) return STATUS_OK;
    /* by descriptor: truncate(2) is closed to workers, because older versions of Landlock do not check it */
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    status s = STATUS_OK;
    if (fd < 0 || ftruncate(fd, (off_t)keep_bytes) != 0) s = error_set_errno(err, "cannot cut '%s'", path);
    if (fd >= 0) close(fd);
    return s;
}
