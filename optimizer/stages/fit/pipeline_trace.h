/* Shared by the stages "fit" and "validation": the path tracer of one model behind a journal, and the progress of one
 * model out of several. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_TRACE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_TRACE_H

#include "optimizer/fit/descent/estimate_journal.h"
#include "optimizer/fit/descent/trace_estimator.h"
#include "optimizer/stages/fit_stages.h"

struct pipeline_trace {
    struct trace_estimator live;
    struct estimator live_estimator;
    struct configuration *configuration;
    struct estimate_journal *journal;
};

/* Opens the journal work/<stage>/<name> of the model ("estimates.journal" for its fit) in front of the path tracer.
 * *t must not move in memory until it is closed, and must be closed after an error too. */
status pipeline_trace_open(struct pipeline_trace *t, const struct cloth_job *job, const struct made_cloth *made,
                           const char *stage, const char *name, size_t i_model, const struct observation_set *o,
                           struct error *err);
void pipeline_trace_close(struct pipeline_trace *t);

/* The parts of it, for tracers of other cloths: the request for the present scene, and a journal before an estimator
 * that depends on the job's fibers and observations. */
void pipeline_trace_request(struct trace_estimator *t, const struct cloth_job *job, const struct made_cloth *made,
                            size_t i_model, const struct configuration *configuration, size_t n_configuration);
status pipeline_trace_journal(const struct cloth_job *job, const struct made_cloth *made, const char *stage,
                              const char *name, size_t i_model, const struct estimator *live,
                              struct estimate_journal **journal, struct error *err);

/* The progress of the i_place-th model to be computed as a part of `whole`: all models take equal shares. */
struct progress pipeline_model_progress(struct progress_part *part, const struct progress *whole, size_t n_model,
                                        size_t i_place);

#endif
