/* Makes the tables of the fast renderer from a flat cloth and the scattering of its fibers (fabric thesis, section
 * 6.4). Takes minutes; the same request gives the same bits for any number of threads.
 */
#ifndef SELVEDGE_RENDERER_FAST_PRECOMPUTE_H
#define SELVEDGE_RENDERER_FAST_PRECOMPUTE_H

#include "base/thread_pool.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/precompute_request.h"

/* A number that differs for another cloth, other parameters, or another request. */
uint64_t fast_tables_checksum(const struct fast_precompute_request *q);

/* Reads the file of the tables that an earlier call made for the same request. STATUS_CONFLICT: they were made for
 * another cloth, other parameters or another request; also the errors of fast_tables_read. t: nothing to release on
 * failure. */
status fast_precompute_kept(const struct fast_precompute_request *q, const char *path, struct fast_tables *t,
                            struct error *err);

/* STATUS_INVALID, field "model": a model that distinguishes directions around the fiber; a bent scene; what
 * parameter_sets_init refuses. STATUS_CANCELLED, STATUS_NO_MEMORY; of the journal STATUS_IO, STATUS_DISK_FULL. t:
 * nothing to release on failure. */
status fast_precompute(const struct fast_precompute_request *q, struct thread_pool *pool,
                       const struct progress *progress, struct fast_tables *t, struct error *err);

#endif
