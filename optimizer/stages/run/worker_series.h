/* series.rec: one record for each step of a fit. A resumed fit passes through all its steps again
 * (estimate_journal.h). Records that exist already are not written a second time, and those after the point of
 * resumption are removed. */
#ifndef SELVEDGE_OPTIMIZER_WORKER_SERIES_H
#define SELVEDGE_OPTIMIZER_WORKER_SERIES_H

#include "base/catalogue/model_catalogue.h"
#include "optimizer/fit/descent/descent.h"
#include "optimizer/stages/run/worker_folder.h"

struct worker_series;

/* The model that a step belongs to. Steps are numbered through all models. */
struct worker_series_model {
    const struct model_info *info;
    const struct fit_parameter *parameter;
    size_t i_model, step_base; /* number of steps of the models before this one */
};

/* Reads the records that exist and removes an incomplete one at the end. */
status worker_series_open(const struct worker_folder *folder, struct worker_series **series, struct error *err);
void worker_series_close(struct worker_series *s);
/* Adds a step. replayed: an earlier attempt has made it, and it is in the file already. */
status worker_series_add(struct worker_series *s, const struct fit_step *step, const struct worker_series_model *model,
                         bool replayed, struct error *err);

#endif
