/* Estimates of a phantom's photographs and scores, kept in its folder chunk by chunk. Only for fit_phantom.c and fit_phantom_score.c. */
#ifndef SELVEDGE_TESTS_KEPT_ESTIMATE_H
#define SELVEDGE_TESTS_KEPT_ESTIMATE_H

#include "tests/support/cloth/fit_phantom.h"

/* Seeds of photographs, of estimates that are kept for scores, and of scores. */
enum { SEED_PHOTOGRAPH = 77001, SEED_KEPT = 77002, SEED_SCORE = 77003 };

struct kept_call {
    const double *param;
    const struct configuration *configuration;
    size_t n_configuration;
    uint64_t seed;
    uint32_t replica;
    bool want_jacobian, plain_paths;
};

/* Ends the program when p is NULL. */
void fit_check_memory(const void *p);
/* Estimates that are not kept: count[i] paths of configuration i; n_path of each. */
void kept_run_counts(const struct fit_phantom *f, const struct kept_call *c, uint32_t iteration, const size_t *count,
                     struct estimate *out);
void kept_run(const struct fit_phantom *f, const struct kept_call *c, uint32_t iteration, size_t n_path,
              struct estimate *out);
/* Checksum of everything that the estimates of a chunk depend on. */
uint32_t kept_call_sum(const struct fit_phantom *f, const struct kept_call *c, uint32_t chunk, size_t n_path);
size_t kept_n_chunks(size_t n_path);
/* n_path paths a configuration in chunks from first_chunk on, read from the folder where they are there. */
void kept_estimate(const struct fit_phantom *f, const struct kept_call *c, size_t first_chunk, size_t n_path,
                   struct estimate *out);

#endif
