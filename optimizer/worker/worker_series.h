/* series.rec: one record a fit step. A resumed fit passes through all its steps again (estimate_journal.h); records
 * that are there already are not written a second time, and what stands behind the point of resumption is cut.
 */
#ifndef SELVEDGE_OPTIMIZER_WORKER_SERIES_H
#define SELVEDGE_OPTIMIZER_WORKER_SERIES_H

#include "optimizer/fit/descent/descent.h"
#include "optimizer/worker/worker_folder.h"
#include "renderer/scattering/appearance.h"

struct worker_series;

/* The model that a step belongs to. The series counts steps of all models through. */
struct worker_series_model {
    const struct appearance *appearance;
    const struct fit_parameter *parameter;
    size_t i_model, step_base; /* steps of the models before */
};

/* Reads what is there and cuts a torn tail. */
status worker_series_open(const struct worker_folder *folder, struct worker_series **series, struct error *err);
void worker_series_close(struct worker_series *s);
/* replayed: the step is one that an earlier attempt has made. */
status worker_series_add(struct worker_series *s, const struct fit_step *step, const struct worker_series_model *model,
                         bool replayed, struct error *err);

#endif
