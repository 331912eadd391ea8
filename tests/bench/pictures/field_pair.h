/* Samples the same fields of one view in two ways until it is settled whether the second has a given error. */
#ifndef SELVEDGE_BENCH_FIELD_PAIR_H
#define SELVEDGE_BENCH_FIELD_PAIR_H

#include "tests/bench/pictures/field_samples.h"

struct field_pair_request {
    const char *name; /* begins the lines on standard error */
    struct radiance_input input[2];
    const struct configuration *configuration;
    double share;  /* edge of a field over the edge of the picture */
    size_t n_side; /* fields along each side; fewer where they would overlap */
    double error;  /* relative, root mean square over fields and channels */
    double most_s; /* processor seconds after which no more samples are taken */
};

/* Both ways have the same number of samples, which is doubled until field_speedup_is_settled. Details go to standard
 * error. Errors as of field_samples_add. */
status field_pair_compare(const struct field_pair_request *q, struct thread_pool *pool, struct field_speedup *speedup,
                          struct error *err);

#endif
