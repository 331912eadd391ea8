/* series.rec: one record a fit step. A resumed fit passes through all its steps again (estimate_journal.h); records
 * that are there already are not written a second time, and what stands behind the point of resumption is cut.
 */
#ifndef SELVEDGE_OPTIMIZER_WORKER_SERIES_H
#define SELVEDGE_OPTIMIZER_WORKER_SERIES_H

#include "optimizer/descent/descent.h"
#include "optimizer/worker_folder.h"

struct worker_series;

/* Reads what is there and cuts a torn tail. */
status worker_series_open(const struct worker_folder *folder, struct worker_series **series, struct error *err);
void worker_series_close(struct worker_series *s);
/* replayed: the step is one that an earlier attempt has made. */
status worker_series_add(struct worker_series *s, const struct fit_step *step, const struct param_info *info,
                         bool replayed, struct error *err);

#endif
