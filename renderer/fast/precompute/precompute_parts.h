/* The parts of fast_precompute: each fills in a part of the tables. */
#ifndef SELVEDGE_RENDERER_PRECOMPUTE_PARTS_H
#define SELVEDGE_RENDERER_PRECOMPUTE_PARTS_H

#include "base/thread_pool.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/precompute_journal.h"
#include "renderer/fast/precompute/precompute_request.h"
#include "renderer/transport/surface/parameter_sets.h"

/* Numbers of the parts in the journal. */
enum { JOURNAL_TRANSFER, JOURNAL_OPEN_SEGMENTS, JOURNAL_COMPONENTS, JOURNAL_SEGMENTS, JOURNAL_DEEP };

struct precompute_job {
    const struct fast_precompute_request *q;
    struct parameter_sets sets;
    struct thread_pool *pool;
    const struct progress *progress; /* of the part that runs */
    struct precompute_journal *journal;
    struct fast_tables *t;
};

/* scatter_table.c: t->scatter. */
status precompute_scatter(struct precompute_job *j, struct error *err);
/* transfer_cells.c: cells and transfer, mean free path, spread. */
status precompute_transfer(struct precompute_job *j, struct error *err);
/* deep_walks.c: t->deep, whose sizes are set. */
status precompute_deep(struct precompute_job *j, struct error *err);
/* segment_visibility.c: the visibility of segments. */
status precompute_visibility(struct precompute_job *j, struct error *err);

#endif
