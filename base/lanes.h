/* Vectors of LANES floats for inner loops, and masks of -1 (true) and 0 that their comparisons give. The compilers map
 * their arithmetic to vector registers. Pointers to float may be read and written as vectors. */
#ifndef SELVEDGE_BASE_LANES_H
#define SELVEDGE_BASE_LANES_H

#include <math.h>
#include <stdint.h>

enum { LANES = 8 };
typedef float lanes __attribute__((vector_size(LANES * sizeof(float)), aligned(sizeof(float)), may_alias));
typedef int32_t lane_mask __attribute__((vector_size(LANES * sizeof(int32_t)), aligned(sizeof(int32_t)), may_alias));

/* a where the mask is true, else b */
static inline lanes lanes_choose(lane_mask m, lanes a, lanes b)
{
    return (lanes)(((lane_mask)a & m) | ((lane_mask)b & ~m));
}

static inline lanes lanes_sqrt(lanes x)
{
    for (int l = 0; l < LANES; l++) x[l] = sqrtf(x[l]);
    return x;
}

static inline float lanes_sum(lanes x) { return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7])); }

#endif
