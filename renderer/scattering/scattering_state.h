/* What the `prepare` functions of models with tables share. */
#ifndef SELVEDGE_RENDERER_SCATTERING_STATE_H
#define SELVEDGE_RENDERER_SCATTERING_STATE_H

#include "renderer/scattering/scattering.h"

/* Makes the tables of a state for parameters in their ranges. The pool may be NULL. */
typedef status (*scattering_fill)(struct scattering_state *state, const double *param, struct thread_pool *pool,
                                  struct error *err);
/* What `prepare` of a model does whose state is one piece of memory: checks the parameters, and fills in a state of so
 * many bytes, all 0. Without an error *state is to be released by free. */
status scattering_state_new(const struct scattering_model *m, const double *param, scattering_fill fill, size_t bytes,
                            struct thread_pool *pool, struct scattering_state **state, struct error *err);

#endif
