/* Estimates for the photographs and scores of a phantom, kept in its folder in chunks. Only for fit_phantom.c and
 * fit_phantom_score.c. */
#ifndef SELVEDGE_TESTS_CACHED_ESTIMATE_H
#define SELVEDGE_TESTS_CACHED_ESTIMATE_H

#include "tests/support/cloth/fit_phantom.h"

/* Seeds of photographs, of the estimates that are kept for scores, and of paths at the scored parameters. */
enum { SEED_PHOTOGRAPH = 77001, SEED_KEPT = 77002, SEED_SCORE = 77003 };

struct cached_call {
    const double *param;
    const struct configuration *configuration;
    size_t n_configuration;
    uint64_t seed;
    uint32_t replica;
    bool want_jacobian, plain_paths;
};

/* Ends the program when p is NULL. */
void fit_check_memory(const void *p);
/* Estimates that are not kept: count[i] paths for configuration i, or n_path paths for each. */
void kept_run_counts(const struct fit_phantom *f, const struct cached_call *c, uint32_t iteration, const size_t *count,
                     struct estimate *out);
void kept_run(const struct fit_phantom *f, const struct cached_call *c, uint32_t iteration, size_t n_path,
              struct estimate *out);
/* Checksum of everything that the estimates of a chunk depend on. */
uint32_t cached_call_sum(const struct fit_phantom *f, const struct cached_call *c, uint32_t chunk, size_t n_path);
size_t cached_n_chunks(size_t n_path);
/* Estimates with n_path paths for each configuration, in chunks from first_chunk on. Chunks that exist in the folder
 * are read from it. */
void cached_estimate(const struct fit_phantom *f, const struct cached_call *c, size_t first_chunk, size_t n_path,
                     struct estimate *out);

#endif
