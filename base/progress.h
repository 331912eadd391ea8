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
    const atomic_bool *cancel;                      /* NULL: cannot be cancelled */
};

/* All three accept p == NULL. */
static inline bool progress_cancelled(const struct progress *p)
{
    return p != NULL && p->cancel != NULL && atomic_load_explicit(p->cancel, memory_order_relaxed);
}

static inline void progress_report(const struct progress *p, double fraction)
{
    if (p != NULL && p->report != NULL) p->report(p->context, fraction);
}

#endif
