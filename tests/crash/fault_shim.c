/* A library for LD_PRELOAD in tests. It makes one system call fail, or records calls.
 * Environment of a fault: FAULT_CALL (write, sync, fallocate), FAULT_AT (number of the matching call that fails,
 * from 1), FAULT_ERRNO (0: a short write of half the bytes), FAULT_PATH (part of the file's path), FAULT_MARK (file
 * made when the fault occurs), FAULT_KILL (if it is set, the process is killed by signal 9 instead, before the call).
 * FAULT_STUCK: name of a file that cannot be removed by unlinkat (EBUSY).
 * FAULT_SLOW_SYNC_S: seconds that every sync takes longer.
 * FAULT_HOLD_SYNC: while this file exists, every sync waits.
 * FAULT_TRACE: file to which every successful write and sync appends a line "write PATH" or "sync PATH". */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static atomic_int n_seen;

/* programs that this one starts run without the library */
__attribute__((constructor)) static void only_here(void) { unsetenv("LD_PRELOAD"); }

/* Finds the path of an open file. Returns false if it is unknown. */
static int find_path(int fd, char file[4096])
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t n = readlink(link, file, 4095);
    if (n <= 0) return 0;
    file[n] = '\0';
    return 1;
}

/* Returns true if this call must fail. */
static int fires(const char *call, int fd)
{
    const char *wanted = getenv("FAULT_CALL"), *at = getenv("FAULT_AT"), *path = getenv("FAULT_PATH"),
               *mark = getenv("FAULT_MARK");
    char file[4096];
    if (wanted == NULL || at == NULL || path == NULL || mark == NULL || strcmp(wanted, call) != 0) return 0;
    if (!find_path(fd, file) || strstr(file, path) == NULL) return 0;
    if (atomic_fetch_add(&n_seen, 1) + 1 != strtol(at, NULL, 10)) return 0;
    int m = open(mark, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    if (m >= 0) close(m);
    if (getenv("FAULT_KILL") != NULL) raise(SIGKILL);
    return 1;
}

static int wanted_errno(void)
{
    const char *e = getenv("FAULT_ERRNO");
    return e == NULL ? EIO : (int)strtol(e, NULL, 10);
}

#define REAL(type, name, ...) ((type(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name))

static void record(const char *call, int fd)
{
    const char *trace = getenv("FAULT_TRACE");
    char file[4096], line[4200];
    int keep = errno;
    if (trace == NULL || !find_path(fd, file)) return;
    int n = snprintf(line, sizeof line, "%s %s\n", call, file),
        t = open(trace, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (t < 0 || REAL(ssize_t, "write", int, const void *, size_t)(t, line, (size_t)n) != n) abort();
    close(t);
    errno = keep;
}

static ssize_t recorded(const char *call, int fd, ssize_t result)
{
    if (result >= 0) record(call, fd);
    return result;
}

static ssize_t faulty_pwrite(const char *name, int fd, const void *data, size_t n, off_t offset)
{
    if (fires("write", fd)) {
        errno = wanted_errno();
        if (errno != 0) return -1;
        n = n > 1 ? n / 2 : n;
    }
    return recorded("write", fd, REAL(ssize_t, name, int, const void *, size_t, off_t)(fd, data, n, offset));
}

ssize_t pwrite(int fd, const void *data, size_t n, off_t offset)
{
    return faulty_pwrite("pwrite", fd, data, n, offset);
}
ssize_t pwrite64(int fd, const void *data, size_t n, off_t offset)
{
    return faulty_pwrite("pwrite64", fd, data, n, offset);
}

ssize_t write(int fd, const void *data, size_t n)
{
    if (fires("write", fd)) {
        errno = wanted_errno();
        if (errno != 0) return -1;
        n = n > 1 ? n / 2 : n;
    }
    return recorded("write", fd, REAL(ssize_t, "write", int, const void *, size_t)(fd, data, n));
}

static void be_slow(void)
{
    const char *seconds = getenv("FAULT_SLOW_SYNC_S");
    const char *hold = getenv("FAULT_HOLD_SYNC");
    while (hold != NULL && access(hold, F_OK) == 0) usleep(5000);
    if (seconds != NULL) usleep((useconds_t)(strtod(seconds, NULL) * 1e6));
}

int fsync(int fd)
{
    be_slow();
    if (fires("sync", fd)) return errno = wanted_errno(), -1;
    return (int)recorded("sync", fd, REAL(int, "fsync", int)(fd));
}

int fdatasync(int fd)
{
    be_slow();
    if (fires("sync", fd)) return errno = wanted_errno(), -1;
    return (int)recorded("sync", fd, REAL(int, "fdatasync", int)(fd));
}

int fallocate(int fd, int mode, off_t from, off_t n)
{
    if (fires("fallocate", fd)) return errno = wanted_errno(), -1;
    return REAL(int, "fallocate", int, int, off_t, off_t)(fd, mode, from, n);
}

int fallocate64(int fd, int mode, off_t from, off_t n) { return fallocate(fd, mode, from, n); }

int unlinkat(int fd, const char *name, int flags)
{
    const char *stuck = getenv("FAULT_STUCK");
    if (stuck != NULL && strcmp(name, stuck) == 0) return errno = EBUSY, -1;
    return REAL(int, "unlinkat", int, const char *, int)(fd, name, flags);
}
