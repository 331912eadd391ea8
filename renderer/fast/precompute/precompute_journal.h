/* A journal file to which the finished parts of a precomputation are appended. An interrupted precomputation continues
 * from it and ends with the same bits. The file begins with the number of the request; records that are incomplete or
 * damaged end it.
 *
 * A part of the work fills arrays row by row, and rows are finished in order, some at a time. */
#ifndef SELVEDGE_RENDERER_PRECOMPUTE_JOURNAL_H
#define SELVEDGE_RENDERER_PRECOMPUTE_JOURNAL_H

#include "base/status.h"
#include "base/thread_pool.h"

#include <stdbool.h>
#include <stdint.h>

enum { JOURNAL_MAX_ARRAY = 2 };

struct precompute_journal {
    const char *path; /* NULL: nothing is kept */
    double every_s;   /* records are written at least so far apart */
    double last_s;
    char *text; /* records of an earlier attempt */
    size_t n_byte;
};

/* A part: its number, and the arrays that row i of it fills from data + i * row_bytes on. */
struct journal_part {
    uint32_t number;
    size_t n_row, n_array;
    struct journal_array {
        void *data;
        size_t row_bytes;
    } array[JOURNAL_MAX_ARRAY];
};

/* Reads the journal of an earlier attempt at the same request at `path`; a file of another request is begun anew.
 * checksum: the number of the request. STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY. Release in any case. */
status precompute_journal_open(struct precompute_journal *j, const char *path, double every_s, uint64_t checksum,
                               struct error *err);
void precompute_journal_release(struct precompute_journal *j);

/* A part that is made as a whole: whether an earlier attempt has made it, from which it is then taken, and keeping
 * it. */
bool precompute_journal_has(const struct precompute_journal *j, const struct journal_part *part);
status precompute_journal_keep(struct precompute_journal *j, const struct journal_part *part, struct error *err);

/* Fills the rows of a part: run(context, i_task, ...) fills the rows of task i_task, which are task_rows each. Rows of
 * earlier attempts are taken from the journal. STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY, STATUS_CANCELLED. */
struct journal_work {
    task_function run;
    void *context;
    size_t task_rows;
    size_t batch_tasks; /* run at least so many of them for each thread before they are kept; 0: 16 */
};
status precompute_journal_run(struct precompute_journal *j, const struct journal_part *part,
                              const struct journal_work *work, struct thread_pool *pool,
                              const struct progress *progress, struct error *err);

#endif
