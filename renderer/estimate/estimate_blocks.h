/* Means over many paths of a radiance source, cut into blocks and reduced in order, so that results depend on key and
 * counts alone. */
#ifndef SELVEDGE_RENDERER_ESTIMATE_BLOCKS_H
#define SELVEDGE_RENDERER_ESTIMATE_BLOCKS_H

#include "base/thread_pool.h"
#include "renderer/estimate/block_trace.h"
#include "renderer/estimate/radiance_estimate.h"

/* Which value is not finite: the index of a configuration and that into its values, radiance first. */
struct estimate_fault {
    size_t i_configuration, i_value;
};

/* out: n_configuration estimates, zero for those in no group. In a helper of a team (base/ranks/rank_team.h) all of
 * them are zero: the root has them. STATUS_CANCELLED, STATUS_TOO_LARGE, STATUS_NO_MEMORY;
 * STATUS_NUMERIC when a value is not finite: *fault says which. */
status estimate_blocks_run(const struct estimate_blocks *b, struct thread_pool *pool, struct estimate *out,
                           struct estimate_fault *fault, struct error *err);

/* STATUS_INVALID for iterations or replicas that random numbers do not distinguish. */
status estimate_check_key(uint32_t iteration, uint32_t replica, struct error *err);

#endif
