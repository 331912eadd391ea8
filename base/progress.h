/* Progress reports and cancellation of a long computation, as its caller passes them in. `report` may be called from
 * any thread, but by one at a time; its fraction rises from 0 to 1. Computations check `cancel` at least every 100
 * ms and return STATUS_CANCELLED when it is set. */
#ifndef SELVEDGE_BASE_PROGRESS_H
#define SELVEDGE_BASE_PROGRESS_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

struct progress {
    void (*report)(void *context, double fraction); /* NULL: progress is not reported */
    void *context;
    const atomic_bool *cancel; /* NULL: cannot be cancelled */
};

/* Both functions accept p == NULL. */
static inline bool progress_cancelled(const struct progress *p)
{
    return p != NULL && p->cancel != NULL && atomic_load_explicit(p->cancel, memory_order_relaxed);
}

static inline void progress_report(const struct progress *p, double fraction)
{
    if (p != NULL && p->report != NULL) p->report(p->context, fraction);
}

/* Returns a progress with the same cancellation as p that reports nothing. */
static inline struct progress progress_silent(const struct progress *p)
{
    return (struct progress){.cancel = p != NULL ? p->cancel : NULL};
}

/* A part of a longer computation: its reports from 0 to 1 are passed on to `outer` as `from` to `from` + `share`. */
struct progress_part {
    const struct progress *outer; /* NULL: progress is not reported */
    double from, share;
};

static inline void progress_report_part(void *part, double fraction)
{
    const struct progress_part *p = (const struct progress_part *)part;
    progress_report(p->outer, p->from + p->share * fraction);
}

/* Returns the progress to pass to the computation of the part. `part` must outlive it; its members may be changed
 * meanwhile. */
static inline struct progress progress_of_part(struct progress_part *part)
{
    return (struct progress){
        .report = progress_report_part, .context = part, .cancel = part->outer != NULL ? part->outer->cancel : NULL};
}

/* Fills part and returns the progress to pass to its computation: fractions 0 .. 1 become from .. from + share of
 * outer, which is not NULL. */
static inline struct progress progress_begin_part(struct progress_part *part, const struct progress *outer, double from,
                                                  double share)
{
    *part = (struct progress_part){outer, from, share};
    return progress_of_part(part);
}

#endif
