/* Drafts of weaves from files of weavers' programs: Weaving Information File (WIF) 1.1, Ravi, Sielaff and others 1997.
 *
 * A file states which warp thread hangs on which shafts (threading), and for each pick the shafts that move: as a list
 * (lift plan), or by treadles (treadling) that are tied to shafts (tie-up). Several treadles of a pick add up. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_WIF_H
#define SELVEDGE_GEOMETRY_WEAVE_WIF_H

#include "base/files/file_ledger.h"
#include "base/status.h"

#include <stddef.h>

enum { WEAVE_WIF_MOST = 32 /* warps and wefts of a repeat */ };

/* One repeat, as drawdowns are drawn: the first pick is the upper row, the first warp thread the right column. '1': the
 * warp lies above. */
struct weave_wif {
    size_t n_warp, n_weft;
    char row[WEAVE_WIF_MOST][WEAVE_WIF_MOST + 1];
};

/* Reads the least repeat of at most WEAVE_WIF_MOST threads that occurs twice in the file, or the whole file. ledger:
 * receives all statements, used or not; may be NULL. STATUS_FORMAT (naming the line, thread or pick): not a WIF, a
 * number that is none, a thread without a shaft, a pick without a treadle, something stated twice, a lift plan and a
 * treadling of different weaves; STATUS_TOO_LARGE: more threads, shafts or treadles than looms have, or no repeat;
 * STATUS_NOT_FOUND, STATUS_IO, STATUS_NO_MEMORY. */
status weave_wif_read(const char *path, struct weave_wif *w, struct file_ledger *ledger, struct error *err);

#endif
