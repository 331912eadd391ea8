#include "renderer/fast/precompute/precompute_journal.h"
#include "base/files/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <zlib.h>

/* Tasks between two looks at the clock, for each thread. */
enum { BATCH_TASKS = 16, MOST_BYTES = 1 << 30 };

struct journal_start {
    char magic[8];
    uint64_t checksum;
};
static const char magic[8] = "SELVFSTJ";

/* Rows first .. first + n - 1 of a part; the arrays' rows follow, one array after the other. */
struct journal_record {
    uint32_t part, first, n, n_byte;
    uint32_t crc; /* of all before it and of the rows */
    uint32_t unused;
};

static double clock_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static uint32_t crc_of(const struct journal_record *r, const char *rows)
{
    uLong crc = crc32_z(0, (const unsigned char *)r, offsetof(struct journal_record, crc));
    return (uint32_t)crc32_z(crc, (const unsigned char *)rows, r->n_byte);
}

/* The record at a place of the text; false: there is none, or it is damaged. */
static bool record_at(const struct precompute_journal *j, size_t at, struct journal_record *r)
{
    if (at + sizeof *r > j->n_byte) return false;
    memcpy(r, j->text + at, sizeof *r);
    return r->n_byte <= j->n_byte - at - sizeof *r && crc_of(r, j->text + at + sizeof *r) == r->crc;
}

status precompute_journal_open(struct precompute_journal *j, const char *path, double every_s, uint64_t checksum,
                               struct error *err)
{
    struct journal_start start = {.checksum = checksum};
    struct journal_record r;
    struct error unread;
    memcpy(start.magic, magic, sizeof magic);
    *j = (struct precompute_journal){.path = path, .every_s = every_s, .last_s = clock_s()};
    if (path == NULL) return STATUS_OK;
    if (file_read_all(path, MOST_BYTES, &j->text, &j->n_byte, &unread) != STATUS_OK || j->n_byte < sizeof start ||
        memcmp(j->text, &start, sizeof start) != 0) {
        j->n_byte = 0;
        return durable_replace(path, &start, sizeof start, err);
    }
    size_t end = sizeof start;
    while (record_at(j, end, &r)) end += sizeof r + r.n_byte;
    j->n_byte = end;
    return record_truncate(path, end, err);
}

void precompute_journal_release(struct precompute_journal *j)
{
    free(j->text);
    *j = (struct precompute_journal){0};
}

static size_t bytes_of(const struct journal_part *p, size_t n_row)
{
    size_t n = 0;
    for (size_t i = 0; i < p->n_array; i++) n += n_row * p->array[i].row_bytes;
    return n;
}

/* Takes the rows of a part from the records, and returns how many there are. */
static size_t restore(const struct precompute_journal *j, const struct journal_part *p)
{
    struct journal_record r;
    size_t done = 0;
    for (size_t at = sizeof(struct journal_start); record_at(j, at, &r); at += sizeof r + r.n_byte) {
        const char *from = j->text + at + sizeof r;
        if (r.part != p->number || r.first != done || r.n > p->n_row - done || r.n_byte != bytes_of(p, r.n)) continue;
        for (size_t i = 0; i < p->n_array; i++) {
            size_t n_byte = r.n * p->array[i].row_bytes;
            memcpy((char *)p->array[i].data + done * p->array[i].row_bytes, from, n_byte);
            from += n_byte;
        }
        done += r.n;
    }
    return done;
}

static status write_all(int fd, const char *data, size_t n, const char *path, struct error *err)
{
    while (n > 0) {
        ssize_t wrote = write(fd, data, n);
        if (wrote < 0 && errno == EINTR) continue;
        if (wrote < 0) return error_set_errno(err, "cannot write '%s'", path_file_name(path));
        data += wrote;
        n -= (size_t)wrote;
    }
    return fsync(fd) == 0 ? STATUS_OK : error_set_errno(err, "cannot write '%s'", path_file_name(path));
}

static status append(struct precompute_journal *j, const struct journal_part *p, size_t first, size_t n,
                     struct error *err)
{
    struct journal_record r = {p->number, (uint32_t)first, (uint32_t)n, (uint32_t)bytes_of(p, n), 0, 0};
    char *block = malloc(sizeof r + r.n_byte);
    if (block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep tables: out of memory");
    char *to = block + sizeof r;
    for (size_t i = 0; i < p->n_array; i++) {
        size_t row = p->array[i].row_bytes;
        memcpy(to, (const char *)p->array[i].data + first * row, n * row);
        to += n * row;
    }
    r.crc = crc_of(&r, block + sizeof r);
    memcpy(block, &r, sizeof r);
    int fd = open(j->path, O_WRONLY | O_APPEND | O_CLOEXEC | O_NOFOLLOW);
    status s = fd >= 0 ? write_all(fd, block, sizeof r + r.n_byte, j->path, err)
                       : error_set_errno(err, "cannot open '%s'", path_file_name(j->path));
    if (fd >= 0) close(fd);
    free(block);
    j->last_s = clock_s();
    return s;
}

bool precompute_journal_has(const struct precompute_journal *j, const struct journal_part *part)
{
    return j->path != NULL && restore(j, part) == part->n_row;
}

status precompute_journal_keep(struct precompute_journal *j, const struct journal_part *part, struct error *err)
{
    return j->path != NULL ? append(j, part, 0, part->n_row, err) : STATUS_OK;
}

/* Tasks from a number on. */
struct shifted {
    const struct journal_work *work;
    size_t first;
};

static void run_shifted(void *context, size_t i_task, size_t i_thread)
{
    const struct shifted *s = context;
    s->work->run(s->work->context, s->first + i_task, i_thread);
}

status precompute_journal_run(struct precompute_journal *j, const struct journal_part *part,
                              const struct journal_work *work, struct thread_pool *pool,
                              const struct progress *progress, struct error *err)
{
    size_t kept = j->path != NULL ? restore(j, part) : 0,
           n_task = (part->n_row + work->task_rows - 1) / work->task_rows;
    size_t batch =
        (work->batch_tasks > 0 ? work->batch_tasks : BATCH_TASKS) * (pool != NULL ? thread_pool_n_thread(pool) : 1);
    kept -= kept == part->n_row ? 0 : kept % work->task_rows; /* a task begins at its first row */
    if (j->path == NULL) batch = n_task;
    for (size_t done = kept; done < part->n_row;) {
        struct shifted s = {work, done / work->task_rows};
        size_t n = n_task - s.first < batch ? n_task - s.first : batch, next = (s.first + n) * work->task_rows;
        struct progress_part of = {progress, (double)s.first / (double)n_task, (double)n / (double)n_task};
        struct progress inner = progress_of_part(&of);
        status st = thread_pool_run(pool, n, run_shifted, &s, &inner);
        if (st == STATUS_OK && progress_cancelled(progress)) st = STATUS_CANCELLED;
        if (st != STATUS_OK) return error_set(err, st, "cancelled");
        done = next < part->n_row ? next : part->n_row;
        bool due = clock_s() - j->last_s >= j->every_s || done == part->n_row;
        if (j->path == NULL || !due) continue;
        st = append(j, part, kept, done - kept, err);
        if (st != STATUS_OK) return st;
        kept = done;
    }
    return STATUS_OK;
}
