/* The work of an estimate (estimate_blocks.h), and the paths of one block of it. */
#ifndef SELVEDGE_RENDERER_BLOCK_TRACE_H
#define SELVEDGE_RENDERER_BLOCK_TRACE_H

#include "base/ranks/rank_team.h"
#include "renderer/estimate/path_groups.h"
#include "renderer/estimate/radiance_source.h"

struct estimate_blocks {
    const struct radiance_source *source;
    const struct configuration *configuration; /* those with contrast_cells give a contrast (contrast_blocks.h) in place
                                                  of a mean; n_rotation is ignored */
    size_t n_configuration;
    const struct path_groups *groups; /* a group's paths are rounded up to whole blocks */
    struct rng_key key;               /* key.configuration is replaced by the number of the group */
    bool next_replica_too;            /* n_configuration more estimates in out: the estimates with key.replica + 1 */
    const struct progress *progress;  /* may be NULL */
    /* Tells the helpers of the pool's team what is estimated, right before the tasks are shared; NULL: they are not. */
    status (*announce)(struct rank_team *team, const void *context, struct error *err);
    const void *announce_context;
};

/* Values of one path: of all members of a group. */
size_t estimate_n_value(const struct estimate_blocks *b, size_t i_group);
/* Traces n paths of a group. value: room for n * estimate_n_value, is cleared first. Result: the number of bounces. */
uint64_t estimate_trace(const struct estimate_blocks *b, size_t i_group, size_t n, double (*xy)[2], struct rng *rng,
                        float *value);

#endif
