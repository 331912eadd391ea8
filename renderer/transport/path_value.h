/* Small parts that both tracers share: random thinning of paths and connections that carry little light, and the guard
 * against values that are not finite. Thresholds are the values that gave the least time to a given standard error
 * on the standard cloths (tests/bench).
 */
#ifndef SELVEDGE_RENDERER_PATH_VALUE_H
#define SELVEDGE_RENDERER_PATH_VALUE_H

#include "base/rng.h"

#include <math.h>
#include <stdbool.h>

#define PATH_SURFACE_ROULETTE_BELOW 0.6f /* throughput under which a path is ended at random */
#define PATH_SURFACE_SHADOW_BELOW 0.01f  /* contribution under which shadow rays are thinned out at random */
#define PATH_SURFACE_GUIDED_BELOW 0.1f   /* throughput under which guided shadow paths are */
#define PATH_VOLUME_ROULETTE_BELOW 0.3f
#define PATH_VOLUME_SHADOW_BELOW 0.02f

static inline float path_value_largest(const float value[3])
{
    float most = value[0] > value[1] ? value[0] : value[1];
    return value[2] > most ? value[2] : most;
}

/* Roulette for a quantity below its threshold. False: it is dropped; otherwise *survival is the probability that it was
 * kept with, by which its contribution is divided. */
static inline bool path_value_survives(float quantity, float below, struct rng *rng, float *survival)
{
    *survival = quantity / below;
    return rng_float(rng) < *survival;
}

/* A model that gives no number must be found out (STATUS_NUMERIC), not taken for black. */
static inline void path_value_keep_nan(float radiance[3], const float value[3])
{
    if (isnan(value[0] + value[1] + value[2])) radiance[0] = NAN;
}

#endif
