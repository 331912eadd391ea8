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

/* Sums over the paths of one or more blocks, in path order: n_value sums, as many sums of squares, and for each pair of
 * members the sum of the products of their radiances, over all channels. Pair (a, b), b < a, has number a (a - 1) / 2 +
 * b. The first of a task has the counts of all its sums. */
struct block_sum {
    uint64_t n_path, n_bounce;
    double *x, *x2, *pair;
};

/* n blocks of a group, beginning with the begin-th after first_block. */
struct block_range {
    uint32_t i_group, first_block, begin, n, per_sum;
};

/* Values of all paths that are traced at once. */
enum { ESTIMATE_MOST_VALUES = 1 << 17 };

/* Values of one path: of all members of a group. */
size_t estimate_n_value(const struct estimate_blocks *b, size_t i_group);
/* How many blocks of a group may be traced at once, by the tracer and by the room for values. */
uint32_t estimate_blocks_at_once(const struct estimate_blocks *b, size_t i_group);
/* Traces blocks. Adds each to its sum, which has per_sum of the blocks from first_block on. value: room for
 * ESTIMATE_MOST_VALUES. */
void estimate_trace_blocks(const struct estimate_blocks *b, const struct block_range *range, float *value,
                           struct block_sum *sum);
/* Traces n paths of a group. Returns the number of bounces. value: n * estimate_n_value floats, which are cleared
 * first. */
uint64_t estimate_trace(const struct estimate_blocks *b, size_t i_group, size_t n, double (*xy)[2], struct rng *rng,
                        float *value);

#endif
