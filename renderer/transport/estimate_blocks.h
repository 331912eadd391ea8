/* Means over many paths, cut into blocks of 256 and reduced in order, so that results depend on key and counts alone:
 * what estimates of every kind of cloth share. */
#ifndef SELVEDGE_RENDERER_ESTIMATE_BLOCKS_H
#define SELVEDGE_RENDERER_ESTIMATE_BLOCKS_H

#include "base/rng.h"
#include "renderer/transport/estimate.h"

enum { ESTIMATE_BLOCK_PATHS = 256 };

struct estimate_blocks {
    size_t n_configuration;
    const size_t *n_path;                      /* per configuration; rounded up to whole blocks; 0: skip */
    const struct configuration *configuration; /* those with contrast_cells give a contrast (contrast_blocks.h) in place
                                                  of a mean; NULL: none does */
    uint64_t seed;
    uint32_t iteration, replica;
    size_t n_jac; /* 3 * number of parameters, 0 without derivatives; at most 3 * SCATTERING_MAX_FLAT */
    /* One path: x and y in [0, 1) of the crop, value[3 + n_jac] preset to 0; result: number of vertices. */
    uint32_t (*trace)(void *context, size_t i_configuration, double x, double y, struct rng *rng, float *value);
    /* In place of that, a whole block at once: xy[ESTIMATE_BLOCK_PATHS][2], a generator for each path (may be changed),
     * value[ESTIMATE_BLOCK_PATHS][3 + n_jac] preset to 0; result: number of vertices. NULL: one by one. */
    uint64_t (*trace_block)(void *context, size_t i_configuration, double (*xy)[2], struct rng *rng, float *value);
    void *context;
};

/* STATUS_CANCELLED, STATUS_TOO_LARGE, STATUS_NO_MEMORY; STATUS_NUMERIC when a value is not finite: *bad_configuration
 * and *bad_value (index into value[]) say which. */
status estimate_blocks_run(const struct estimate_blocks *b, struct thread_pool *pool, const struct progress *progress,
                           struct estimate *out, size_t *bad_configuration, size_t *bad_value, struct error *err);

/* STATUS_INVALID for more configurations, iterations or replicas than random numbers distinguish, and for angles or
 * distances that make no sense. */
status estimate_check_configurations(const struct configuration *c, size_t n_configuration, uint32_t iteration,
                                     uint32_t replica, struct error *err);

#endif
