/* The checkpoint of a fit: every estimate that the path tracer has returned, in order, in a file that survives kill -9.
 *
 * Methods are deterministic functions of the estimates they ask for. So a resumed fit starts from the beginning, and
 * the journal answers every call that was answered before, bit by bit; the first new call goes to the path tracer
 * again. No method has state of its own to save, and a resumed fit ends exactly as an uninterrupted one. A record holds
 * the call as well: one that does not match the call (another program version, another seed) ends the replay, and the
 * rest of the file is cut.
 *
 * File: 8 bytes "SELVJNL1", u64 fingerprint; then records { u32 bytes, u32 crc32, payload }. Host byte order: the file
 * is scratch of one machine. Cutting the file behind record k makes the fit resume from there. */
#ifndef SELVEDGE_OPTIMIZER_ESTIMATE_JOURNAL_H
#define SELVEDGE_OPTIMIZER_ESTIMATE_JOURNAL_H

#include "optimizer/fit/descent/estimator.h"

struct estimate_journal;

/* Opens or creates the journal at path. live: the estimator that answers calls which the journal cannot; it must
 * outlive the journal. may_write is called before each record is written, and its error is returned (NULL: writing is
 * always allowed). fingerprint: of everything but the call that an estimate depends on; a file with another one is
 * started anew. STATUS_IO, STATUS_NO_MEMORY. */
status estimate_journal_open(const char *path, uint64_t fingerprint, const struct estimator *live,
                             status (*may_write)(void *context, struct error *err), void *may_write_context,
                             struct estimate_journal **journal, struct error *err);
void estimate_journal_close(struct estimate_journal *j);
/* The journal as an estimator. */
struct estimator estimate_journal_estimator(struct estimate_journal *j);
/* True while calls are answered from the file. */
bool estimate_journal_replaying(const struct estimate_journal *j);
/* Calls answered from the file so far. */
size_t estimate_journal_n_replayed(const struct estimate_journal *j);

#endif
