#include "renderer/estimate/block_trace.h"

#include <string.h>

size_t estimate_n_value(const struct estimate_blocks *b, size_t i_group)
{
    return b->groups->group[i_group].n * (3 + 3 * b->source->n_flat);
}

uint64_t estimate_trace(const struct estimate_blocks *b, size_t i_group, size_t n, double (*xy)[2], struct rng *rng,
                        float *value)
{
    const struct path_group *g = &b->groups->group[i_group];
    const struct radiance_block block = {.member = b->groups->member + g->first,
                                         .n_member = g->n,
                                         .n_path = n,
                                         .xy = xy,
                                         .rng = rng,
                                         .progress = b->progress};
    memset(value, 0, n * estimate_n_value(b, i_group) * sizeof *value);
    return b->source->tracer->trace(b->source->state, &block, value);
}
