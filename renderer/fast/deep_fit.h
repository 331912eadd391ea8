/* Fits the factor on deep light (deep_factor.h) to paths of one view. */
#ifndef SELVEDGE_RENDERER_DEEP_FIT_H
#define SELVEDGE_RENDERER_DEEP_FIT_H

#include "base/thread_pool.h"
#include "renderer/fast/deep_factor.h"
#include "renderer/transport/radiance_tracer.h"

struct deep_fit {
    struct deep_factor factor;
    bool used;         /* false: the paths show no better factor than 1 */
    double difference; /* deep light of the paths less the tables', over the latter, before the fit */
    double error;      /* standard error of that */
};

/* in->fast: with deep, whose factor is not looked at. n_path: camera rays over the crop of c; paths cost some 40 us.
 * Weights are drawn towards a factor of 1 as much as serves one half of the paths for the other. The bits do not depend
 * on the number of threads. Errors of radiance_source preparation, STATUS_NO_MEMORY, STATUS_CANCELLED. */
status deep_fit_make(const struct radiance_input *in, const struct configuration *c, size_t n_path, uint64_t seed,
                     struct thread_pool *pool, const struct progress *progress, struct deep_fit *fit,
                     struct error *err);

#endif
