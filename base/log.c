#include "base/log.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

struct log {
    int fd;
    FILE *also;
    enum log_level least;
    pthread_mutex_t lock;
};

status log_open(const char *path, FILE *also, enum log_level least, struct log **log, struct error *err)
{
    struct log *l = calloc(1, sizeof *l);
    if (l == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot open log: out of memory");
    l->fd = -1;
    l->also = also;
    l->least = least;
    if (path != NULL) {
        l->fd = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
        if (l->fd < 0) {
            free(l);
            return error_set_errno(err, "cannot open log '%s'", path);
        }
    }
    pthread_mutex_init(&l->lock, NULL);
    *log = l;
    return STATUS_OK;
}

void log_close(struct log *l)
{
    if (l == NULL) return;
    if (l->fd >= 0) close(l->fd);
    pthread_mutex_destroy(&l->lock);
    free(l);
}

void log_write(struct log *l, enum log_level level, const char *format, ...)
{
    static const char *const level_name[] = {"DEBUG", "INFO", "WARNING", "ERROR"};
    if (l == NULL || level < l->least) return;
    char line[2048];
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    struct tm utc;
    gmtime_r(&now.tv_sec, &utc);
    size_t n = strftime(line, sizeof line, "%Y-%m-%dT%H:%M:%S", &utc);
    n += (size_t)snprintf(line + n, sizeof line - n, ".%03ldZ %s ", now.tv_nsec / 1000000, level_name[level]);
    va_list args;
    va_start(args, format);
    int m = vsnprintf(line + n, sizeof line - n - 1, format, args);
    va_end(args);
    size_t end = n + (size_t)(m < 0 ? 0 : m);
    if (end > sizeof line - 2) end = sizeof line - 2;
    for (size_t i = n; i < end; i++)
        if (line[i] == '\n' || line[i] == '\r') line[i] = ' ';
    line[end++] = '\n';
    pthread_mutex_lock(&l->lock);
    if (l->fd >= 0 && write(l->fd, line, end) < 0) { /* a failure to write the log must not stop the work */
    }
    if (l->also != NULL) fwrite(line, 1, end, l->also);
    pthread_mutex_unlock(&l->lock);
}
