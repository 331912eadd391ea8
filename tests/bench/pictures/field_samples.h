/* Samples of small square fields that are spread over a picture: to compare two pictures' means over such fields, few
 * fields with many samples each need far fewer paths than all of the picture. */
#ifndef SELVEDGE_BENCH_FIELD_SAMPLES_H
#define SELVEDGE_BENCH_FIELD_SAMPLES_H

#include "base/thread_pool.h"
#include "renderer/estimate/radiance_source.h"
#include "tests/bench/pictures/field_comparison.h"

struct field_request {
    struct radiance_input input;
    const struct configuration *configuration;
    double share;                  /* edge of a field over the edge of the picture, at most 1 / n_side */
    size_t n_side;                 /* one field at a random place of each of n_side x n_side squares of the picture */
    size_t first_sample, n_sample; /* of each field; others than before add to the same sums */
    uint64_t seed;                 /* places depend on it alone */
    uint32_t stream;               /* of random numbers, at most 4095 */
};

/* Adds to sum[n_side * n_side]. Samples lie evenly over the fields. Errors as of radiance_source_init. */
status field_samples_add(const struct field_request *q, struct thread_pool *pool, struct field_sum *sum,
                         struct error *err);

#endif
