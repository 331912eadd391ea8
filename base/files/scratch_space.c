#include "base/files/scratch_space.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <unistd.h>

enum { LEAST_LIMIT = 1 << 20, HUGE_PAGE = 2 << 20 };

struct array {
    void *address;
    size_t n_bytes;
    bool in_file;
    struct array *next;
};

struct scratch_space {
    char *folder;
    size_t limit_bytes, page_bytes, most_file_bytes;
    int statm_fd; /* -1: the resident size is unknown, and every call drops the mapped pages */
    pthread_mutex_t lock;
    struct array *array;
    size_t memory_bytes; /* of the arrays that are not in files */
    size_t most_bytes;   /* of all arrays at one time */
    atomic_size_t file_bytes;
    atomic_bool dropping;
};

status scratch_space_new(const char *folder, size_t limit_bytes, struct scratch_space **space, struct error *err)
{
    *space = NULL;
    if (limit_bytes < LEAST_LIMIT)
        return error_set(err, STATUS_INVALID, "a memory limit of %zu bytes is too small: at least %d are needed",
                         limit_bytes, LEAST_LIMIT);
    struct scratch_space *s = calloc(1, sizeof *s);
    if (s != NULL) s->folder = strdup(folder);
    if (s == NULL || s->folder == NULL) {
        free(s);
        return error_set(err, STATUS_NO_MEMORY, "cannot use scratch folder '%s': out of memory", folder);
    }
    long page = sysconf(_SC_PAGESIZE);
    s->page_bytes = page > 0 ? (size_t)page : 4096;
    s->limit_bytes = limit_bytes;
    s->most_file_bytes = SIZE_MAX;
    s->statm_fd = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    pthread_mutex_init(&s->lock, NULL);
    *space = s;
    return STATUS_OK;
}

void scratch_space_free(struct scratch_space *s)
{
    if (s == NULL) return;
    while (s->array != NULL) scratch_release(s, s->array->address);
    if (s->statm_fd >= 0) close(s->statm_fd);
    pthread_mutex_destroy(&s->lock);
    free(s->folder);
    free(s);
}

void scratch_space_bound(struct scratch_space *s, size_t most_file_bytes)
{
    s->most_file_bytes = most_file_bytes > 0 ? most_file_bytes : SIZE_MAX;
}

static status too_large(const struct scratch_space *s, double n_bytes, const char *what, struct error *err)
{
    return error_set(err, STATUS_TOO_LARGE,
                     "cannot work on %s: %.3g GB are needed, but a job may hold %.3g GB in files", what, n_bytes * 1e-9,
                     (double)s->most_file_bytes * 1e-9);
}

status scratch_check(struct scratch_space *s, double n_bytes, const char *what, struct error *err)
{
    struct statvfs disk;
    if (s == NULL || n_bytes <= 0.5 * (double)s->limit_bytes) return STATUS_OK;
    if (n_bytes > (double)s->most_file_bytes) return too_large(s, n_bytes, what, err);
    if (statvfs(s->folder, &disk) != 0) return STATUS_OK; /* scratch_new will fail if space is missing */
    double free_bytes = (double)disk.f_bavail * (double)disk.f_frsize;
    if (n_bytes <= free_bytes) return STATUS_OK;
    return error_set(err, STATUS_TOO_LARGE, "cannot work on %s: %.3g GB are needed, but the disk has %.3g GB left",
                     what, n_bytes * 1e-9, free_bytes * 1e-9);
}

/* Maps a new nameless file with all blocks reserved. The descriptor is closed, because the mapping keeps the file
 * alive. */
static status map_file(struct scratch_space *s, size_t n_bytes, const char *what, void **address, struct error *err)
{
    status st = STATUS_OK;
    char path[4096];
    int fd = open(s->folder, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (fd < 0 && (errno == EOPNOTSUPP || errno == EISDIR || errno == ENOENT ||
                   errno == EINVAL)) { /* this file system lacks O_TMPFILE */
        snprintf(path, sizeof path, "%s/scratch-XXXXXX", s->folder);
        fd = mkostemp(path, O_CLOEXEC);
        if (fd >= 0) unlink(path);
    }
    if (fd < 0) return error_set_errno(err, "cannot keep %s in '%s'", what, s->folder);
    int failed = posix_fallocate(fd, 0, (off_t)n_bytes);
    if (failed != 0) {
        errno = failed;
        st = error_set_errno(err, "cannot reserve %zu MB on disk for %s in '%s'", n_bytes / 1000000, what, s->folder);
    } else {
        *address = mmap(NULL, n_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        if (*address == MAP_FAILED)
            st =
                error_set_errno(err, "cannot map %zu MB for %s (limit of the address space?)", n_bytes / 1000000, what);
    }
    close(fd);
    return st;
}

static status map_memory(size_t n_bytes, const char *what, void **address, struct error *err)
{
    *address = mmap(NULL, n_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (*address == MAP_FAILED)
        return error_set(err, STATUS_NO_MEMORY, "cannot get %zu MB for %s: out of memory", n_bytes / 1000000, what);
    /* only a hint, so its result is ignored */
    if (n_bytes >= 4 * (size_t)HUGE_PAGE) madvise(*address, n_bytes, MADV_HUGEPAGE);
    return STATUS_OK;
}

status scratch_new(struct scratch_space *s, size_t n_bytes, const char *what, void **result, struct error *err)
{
    *result = NULL;
    if (n_bytes == 0) n_bytes = 1;
    if (s == NULL) {
        *result = calloc(n_bytes, 1);
        return *result != NULL ? STATUS_OK
                               : error_set(err, STATUS_NO_MEMORY, "cannot get %zu MB for %s: out of memory",
                                           n_bytes / 1000000, what);
    }
    struct array *a = calloc(1, sizeof *a);
    if (a == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot get %zu MB for %s: out of memory", n_bytes / 1000000, what);
    a->n_bytes = n_bytes;
    pthread_mutex_lock(&s->lock);
    a->in_file = n_bytes > s->limit_bytes / 2 || s->memory_bytes > s->limit_bytes / 2 - n_bytes;
    if (!a->in_file) s->memory_bytes += n_bytes;
    pthread_mutex_unlock(&s->lock);
    status st = STATUS_OK;
    size_t in_files = atomic_load(&s->file_bytes);
    if (a->in_file && (in_files > s->most_file_bytes || n_bytes > s->most_file_bytes - in_files))
        st = too_large(s, (double)in_files + (double)n_bytes, what, err);
    if (st == STATUS_OK)
        st = a->in_file ? map_file(s, n_bytes, what, &a->address, err) : map_memory(n_bytes, what, &a->address, err);
    pthread_mutex_lock(&s->lock);
    if (st == STATUS_OK) {
        a->next = s->array;
        s->array = a;
        if (a->in_file) atomic_fetch_add(&s->file_bytes, n_bytes);
        const size_t all = s->memory_bytes + atomic_load(&s->file_bytes);
        if (all > s->most_bytes) s->most_bytes = all;
        *result = a->address;
    } else if (!a->in_file) {
        s->memory_bytes -= n_bytes;
    }
    pthread_mutex_unlock(&s->lock);
    if (st != STATUS_OK) free(a);
    return st;
}

void scratch_release(struct scratch_space *s, void *address)
{
    if (address == NULL) return;
    if (s == NULL) {
        free(address);
        return;
    }
    pthread_mutex_lock(&s->lock);
    struct array **at = &s->array, *found;
    while (*at != NULL && (*at)->address != address) at = &(*at)->next;
    found = *at;
    if (found != NULL) {
        *at = found->next;
        munmap(found->address, found->n_bytes);
        if (found->in_file)
            atomic_fetch_sub(&s->file_bytes, found->n_bytes);
        else
            s->memory_bytes -= found->n_bytes;
    }
    pthread_mutex_unlock(&s->lock);
    free(found);
}

/* Returns the resident bytes of the process, or SIZE_MAX if the kernel does not report them. */
static size_t resident_bytes(const struct scratch_space *s)
{
    char text[128];
    ssize_t n = s->statm_fd >= 0 ? pread(s->statm_fd, text, sizeof text - 1, 0) : -1;
    if (n <= 0) return SIZE_MAX;
    text[n] = '\0';
    char *end;
    strtoull(text, &end, 10); /* skip the first number, the size of the address space */
    return (size_t)strtoull(end, NULL, 10) * s->page_bytes;
}

void scratch_keep_within(struct scratch_space *s)
{
    if (s == NULL || atomic_load_explicit(&s->file_bytes, memory_order_relaxed) == 0) return;
    if (resident_bytes(s) <= s->limit_bytes - s->limit_bytes / 8) return;
    if (atomic_exchange(&s->dropping, true)) return; /* another thread is already dropping pages */
    pthread_mutex_lock(&s->lock);
    for (struct array *a = s->array; a != NULL; a = a->next)
        if (a->in_file) madvise(a->address, a->n_bytes, MADV_DONTNEED); /* of a shared mapping: the contents stay */
    pthread_mutex_unlock(&s->lock);
    atomic_store(&s->dropping, false);
}

size_t scratch_buffer_bytes(const struct scratch_space *s)
{
    return s == NULL ? (size_t)256 << 20 : s->limit_bytes / 8;
}

size_t scratch_most_bytes(struct scratch_space *s)
{
    pthread_mutex_lock(&s->lock);
    const size_t most = s->most_bytes;
    pthread_mutex_unlock(&s->lock);
    return most;
}

size_t scratch_file_bytes(struct scratch_space *s) { return s == NULL ? 0 : atomic_load(&s->file_bytes); }
