#include "optimizer/stages/run/speed_book.h"
#include "base/files/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

enum { LIMIT_BYTES = 1 << 20 };
/* A job whose logarithm of seconds per unit is further than this from the mean counts as if it were so far: one job on
 * a machine that was busy with something else moves the mean little, and a machine that has changed moves it soon. */
static const double most_off = 1.0;

static bool read_entry(const char *key, const json_t *from, struct speed_entry *e)
{
    const json_t *curve = json_object_get(from, "curve");
    snprintf(e->key, sizeof e->key, "%s", key);
    e->n_job = json_number_value(json_object_get(from, "n_job"));
    e->log_s_per_unit = json_number_value(json_object_get(from, "log_s_per_unit"));
    e->log_var = json_number_value(json_object_get(from, "log_var"));
    double before = 0.0;
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) {
        e->curve[k] = json_number_value(json_array_get(curve, k));
        if (!(e->curve[k] >= before && e->curve[k] <= 1.0)) return false;
        before = e->curve[k];
    }
    return e->n_job >= 1.0 && isfinite(e->n_job) && fabs(e->log_s_per_unit) < 100.0 && e->log_var >= 0.0 &&
           e->log_var < 100.0;
}

/* Locks the file for reading or writing it whole; -1: it cannot be opened, or another worker holds it for longer than
 * anyone needs. Closing it ends the lock. */
static int open_locked(const char *path, int flags, int how)
{
    const struct timespec pause = {0, 20000000};
    int fd = open(path, flags | O_CLOEXEC, 0600), error = 0;
    for (int i = 0; fd >= 0 && i < 50; i++) {
        if (flock(fd, how | LOCK_NB) == 0) return fd;
        error = errno;
        if (error != EINTR && error != EWOULDBLOCK) break;
        nanosleep(&pause, NULL);
    }
    if (fd >= 0) {
        close(fd);
        errno = error;
    }
    return -1;
}

/* Overwrites the file, because a worker in its sandbox may make none in the folder. A worker that is killed meanwhile
 * leaves a damaged file, which is an empty book. */
static status overwrite(const char *path, const char *text, size_t n, struct error *err)
{
    int fd = open_locked(path, O_WRONLY | O_CREAT, LOCK_EX);
    if (fd < 0) return error_set_errno(err, "cannot write '%s'", path);
    status s = STATUS_OK;
    if (write(fd, text, n) != (ssize_t)n || ftruncate(fd, (off_t)n) != 0)
        s = error_set_errno(err, "cannot write '%s'", path);
    close(fd);
    return s;
}

void speed_book_read(const char *path, struct speed_book *book)
{
    char *text = NULL;
    size_t n = 0;
    const char *key;
    json_t *value;
    book->n = 0;
    int fd = open_locked(path, O_RDONLY, LOCK_SH);
    status s = file_read_all(path, LIMIT_BYTES, &text, &n, NULL);
    if (fd >= 0) close(fd);
    if (s != STATUS_OK) return;
    json_t *json = json_loadb(text, n, JSON_REJECT_DUPLICATES, NULL);
    json_object_foreach(json_object_get(json, "speeds"), key, value)
    {
        if (book->n < SPEED_BOOK_MAX_ENTRY && read_entry(key, value, &book->entry[book->n])) book->n++;
    }
    json_decref(json);
    free(text);
}

status speed_book_write(const char *path, const struct speed_book *book, struct error *err)
{
    json_t *speeds = json_object();
    for (size_t i = 0; i < book->n; i++) {
        const struct speed_entry *e = &book->entry[i];
        json_t *curve = json_array();
        for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) json_array_append_new(curve, json_real(e->curve[k]));
        json_object_set_new(speeds, e->key,
                            json_pack("{s:f, s:f, s:f, s:o}", "n_job", e->n_job, "log_s_per_unit", e->log_s_per_unit,
                                      "log_var", e->log_var, "curve", curve));
    }
    json_t *json = json_pack("{s:i, s:o}", "format", 1, "speeds", speeds);
    char *text = json != NULL ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(6)) : NULL;
    json_decref(json);
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    status s = overwrite(path, text, strlen(text), err);
    free(text);
    return s;
}

const struct speed_entry *speed_book_find(const struct speed_book *book, const char *key)
{
    for (size_t i = 0; i < book->n; i++)
        if (strcmp(book->entry[i].key, key) == 0) return &book->entry[i];
    return NULL;
}

static struct speed_entry *make_entry(struct speed_book *book, const char *key)
{
    if (book->n == SPEED_BOOK_MAX_ENTRY) memmove(&book->entry[0], &book->entry[1], --book->n * sizeof book->entry[0]);
    struct speed_entry *e = &book->entry[book->n++];
    *e = (struct speed_entry){0};
    snprintf(e->key, sizeof e->key, "%s", key);
    return e;
}

void speed_book_add(struct speed_book *book, const char *key, double seconds, double units,
                    const double curve[SPEED_CURVE_POINTS])
{
    const struct speed_entry *known = speed_book_find(book, key);
    struct speed_entry *e = known != NULL ? &book->entry[known - book->entry] : make_entry(book, key);
    e->n_job = fmin(e->n_job + 1.0, SPEED_BOOK_MEMORY);
    double share = 1.0 / e->n_job, off = log(seconds / units) - e->log_s_per_unit;
    if (known != NULL) off = fmin(fmax(off, -most_off), most_off);
    e->log_s_per_unit += share * off;
    e->log_var = (1.0 - share) * (e->log_var + share * off * off);
    for (size_t k = 0; k < SPEED_CURVE_POINTS; k++) e->curve[k] += share * (curve[k] - e->curve[k]);
}
