/* Means over many paths of a radiance source, cut into blocks and reduced in order, so that results depend on key and
 * counts alone. */
#ifndef SELVEDGE_RENDERER_ESTIMATE_BLOCKS_H
#define SELVEDGE_RENDERER_ESTIMATE_BLOCKS_H

#include "renderer/estimate/estimate.h"
#include "renderer/estimate/path_groups.h"

struct estimate_blocks {
    const struct radiance_source *source;
    const struct configuration *configuration; /* those with contrast_cells give a contrast (contrast_blocks.h) in place
                                                  of a mean; n_rotation is ignored */
    size_t n_configuration;
    const struct path_groups *groups; /* a group's paths are rounded up to whole blocks */
    struct rng_key key;               /* key.configuration is replaced by the number of the group */
    bool next_replica_too;            /* n_configuration more estimates in out: those of key.replica + 1 */
    const struct progress *progress;  /* may be NULL */
    /* Tells the helpers of the pool's team what is estimated, right before the tasks are shared; NULL: they are not. */
    status (*announce)(struct rank_team *team, const void *context, struct error *err);
    const void *announce_context;
};

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

/* Values of one path: of all members of a group. */
size_t estimate_n_value(const struct estimate_blocks *b, size_t i_group);
/* Traces n paths of a group. value: room for n * estimate_n_value, is cleared first. Result: the number of bounces. */
uint64_t estimate_trace(const struct estimate_blocks *b, size_t i_group, size_t n, double (*xy)[2], struct rng *rng,
                        float *value);

#endif
