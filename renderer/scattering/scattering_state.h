/* Common part of the `prepare` functions of models with tables. */
#ifndef SELVEDGE_RENDERER_SCATTERING_STATE_H
#define SELVEDGE_RENDERER_SCATTERING_STATE_H

#include "renderer/scattering/scattering.h"

/* Makes the tables of a state for parameters in their ranges. The pool may be NULL. */
typedef status (*scattering_fill)(struct scattering_state *state, const double *param, struct thread_pool *pool,
                                  struct error *err);
/* Serves as `prepare` of a model whose state is one piece of memory: checks the parameters, allocates `bytes` of zeros,
 * and calls `fill`. Without an error *state is to be released by free. */
status scattering_state_new(const struct scattering_model *m, const double *param, scattering_fill fill, size_t bytes,
                            struct thread_pool *pool, struct scattering_state **state, struct error *err);

#endif
