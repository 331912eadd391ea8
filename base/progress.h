/* Progress out, cancellation in: what a long computation takes from its caller.
 * `report` may be called from any thread, but one call at a time; fraction rises from 0 to 1.
 * Computations look at `cancel` at least every 100 ms and return STATUS_CANCELLED when it is set. */
#ifndef SELVEDGE_BASE_PROGRESS_H
#define SELVEDGE_BASE_PROGRESS_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

struct progress {
    void (*report)(void *context, double fraction); /* NULL: nobody listens */
    void *context;
    const atomic_bool *cancel; /* NULL: cannot be cancelled */
};

/* These accept p == NULL. */
static inline bool progress_cancelled(const struct progress *p)
{
    return p != NULL && p->cancel != NULL && atomic_load_explicit(p->cancel, memory_order_relaxed);
}

static inline void progress_report(const struct progress *p, double fraction)
{
    if (p != NULL && p->report != NULL) p->report(p->context, fraction);
}

/* To be cancelled like p, but without its reports. */
static inline struct progress progress_silent(const struct progress *p)
{
    return (struct progress){.cancel = p != NULL ? p->cancel : NULL};
}

/* A part of a longer computation: what it reports from 0 to 1 is from .. from + share of the whole. */
struct progress_part {
    const struct progress *outer; /* NULL: nobody listens */
    double from, share;
};

static inline void progress_report_part(void *part, double fraction)
{
    const struct progress_part *p = (const struct progress_part *)part;
    progress_report(p->outer, p->from + p->share * fraction);
}

/* What the part's computation takes; part may be changed as long as it lives. */
static inline struct progress progress_of_part(struct progress_part *part)
{
    return (struct progress){
        .report = progress_report_part, .context = part, .cancel = part->outer != NULL ? part->outer->cancel : NULL};
}

#endif
