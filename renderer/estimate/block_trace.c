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

uint32_t estimate_blocks_at_once(const struct estimate_blocks *b, size_t i_group)
{
    const size_t room = ESTIMATE_MOST_VALUES / (RADIANCE_BLOCK_PATHS * estimate_n_value(b, i_group)),
                 most = b->source->tracer->max_path / RADIANCE_BLOCK_PATHS;
    return (uint32_t)(room < most ? room : most);
}

/* Adds the products of the members' radiances on one path. value: n_value of each of the n_member members. */
static void add_pairs(const float *value, size_t n_member, size_t n_value, double *pair)
{
    for (size_t a = 1; a < n_member; a++)
        for (size_t b = 0; b < a; b++, pair++)
            for (size_t c = 0; c < 3; c++) *pair += (double)value[a * n_value + c] * (double)value[b * n_value + c];
}

static void add_block(const float *value, size_t n_member, size_t n_value, struct block_sum *sum)
{
    for (size_t i = 0; i < RADIANCE_BLOCK_PATHS; i++) {
        for (size_t k = 0; k < n_value; k++) {
            double v = (double)value[i * n_value + k];
            sum->x[k] += v;
            sum->x2[k] += v * v;
        }
        add_pairs(value + i * n_value, n_member, n_value / n_member, sum->pair);
    }
}

void estimate_trace_blocks(const struct estimate_blocks *b, const struct block_range *range, float *value,
                           struct block_sum *sum)
{
    const size_t n_value = estimate_n_value(b, range->i_group), n_member = b->groups->group[range->i_group].n;
    const uint32_t n_path = range->n * RADIANCE_BLOCK_PATHS;
    struct rng_key key = b->key;
    struct rng rng[RADIANCE_MOST_PATHS];
    double xy[RADIANCE_MOST_PATHS][2];
    key.configuration = range->i_group;
    for (uint32_t i = 0; i < n_path; i++) {
        rng_start(&rng[i], &key, range->first_block + range->begin + i / RADIANCE_BLOCK_PATHS,
                  i % RADIANCE_BLOCK_PATHS);
        for (int a = 0; a < 2; a++) xy[i][a] = rng_double(&rng[i]);
    }
    sum->n_bounce += estimate_trace(b, range->i_group, n_path, xy, rng, value);
    sum->n_path += n_path;
    for (uint32_t k = 0; k < range->n; k++)
        add_block(value + (size_t)k * RADIANCE_BLOCK_PATHS * n_value, n_member, n_value,
                  &sum[(range->begin + k) / range->per_sum]);
}
