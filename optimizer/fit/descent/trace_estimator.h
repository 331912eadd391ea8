/* The path tracer as an estimator: mean radiances of a list of configurations for one model of appearance. */
#ifndef SELVEDGE_OPTIMIZER_TRACE_ESTIMATOR_H
#define SELVEDGE_OPTIMIZER_TRACE_ESTIMATOR_H

#include "base/thread_pool.h"
#include "optimizer/fit/descent/estimator.h"
#include "optimizer/photographs/rows/observation.h"
#include "renderer/estimate/estimate.h"

/* Everything pointed to outlives the estimator. */
struct trace_estimator {
    struct estimate_request request; /* parameter values, counts, iteration and replica come from each call */
    struct thread_pool *pool;
};

struct estimator trace_estimator(struct trace_estimator *t);
/* The configurations of a set of observations, in its order; free() them. NULL without memory. */
struct configuration *trace_configurations(const struct observation_set *o);

#endif
