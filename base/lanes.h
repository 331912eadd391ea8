/* Vectors of LANES floats for inner loops, and masks of -1 (true) and 0 that their comparisons give. The compilers map
 * their arithmetic to vector registers. Pointers to float may be read and written as vectors. */
#ifndef SELVEDGE_BASE_LANES_H
#define SELVEDGE_BASE_LANES_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

enum { LANES = 8 };
typedef float lanes __attribute__((vector_size(LANES * sizeof(float)), aligned(sizeof(float)), may_alias));
typedef int32_t lane_mask __attribute__((vector_size(LANES * sizeof(int32_t)), aligned(sizeof(int32_t)), may_alias));

/* a where the mask is true, else b */
static inline lanes lanes_choose(lane_mask m, lanes a, lanes b)
{
    return (lanes)(((lane_mask)a & m) | ((lane_mask)b & ~m));
}

/* Whether the mask is true anywhere. */
static inline bool lanes_any(lane_mask m)
{
    int32_t any = 0;
    for (int l = 0; l < LANES; l++) any |= m[l];
    return any != 0;
}

static inline lanes lanes_sqrt(lanes x)
{
    for (int l = 0; l < LANES; l++) x[l] = sqrtf(x[l]);
    return x;
}

/* Four floats that lie beside each other, such as the numbers of one voxel. */
typedef float lane_row __attribute__((vector_size(4 * sizeof(float)), aligned(sizeof(float)), may_alias));

/* Turns LANES rows of four floats into four vectors: float k of row l becomes lane l of vector k. */
static inline void lanes_of_rows(const lane_row row[LANES], lanes of[4])
{
    lanes a[4], low[2], high[2];
    for (int i = 0; i < 4; i++) a[i] = __builtin_shufflevector(row[i], row[i + 4], 0, 1, 2, 3, 4, 5, 6, 7);
    for (int i = 0; i < 2; i++) {
        low[i] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
        high[i] = __builtin_shufflevector(a[2 * i], a[2 * i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
    }
    of[0] = __builtin_shufflevector(low[0], low[1], 0, 1, 8, 9, 4, 5, 12, 13);
    of[1] = __builtin_shufflevector(low[0], low[1], 2, 3, 10, 11, 6, 7, 14, 15);
    of[2] = __builtin_shufflevector(high[0], high[1], 0, 1, 8, 9, 4, 5, 12, 13);
    of[3] = __builtin_shufflevector(high[0], high[1], 2, 3, 10, 11, 6, 7, 14, 15);
}

/* The inverse of lanes_of_rows. */
static inline void lanes_to_rows(const lanes of[4], lane_row row[LANES])
{
    lanes low[2], high[2], a[4];
    for (int i = 0; i < 2; i++) {
        low[i] = __builtin_shufflevector(of[2 * i], of[2 * i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
        high[i] = __builtin_shufflevector(of[2 * i], of[2 * i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
    }
    a[0] = __builtin_shufflevector(low[0], low[1], 0, 1, 8, 9, 4, 5, 12, 13);
    a[1] = __builtin_shufflevector(low[0], low[1], 2, 3, 10, 11, 6, 7, 14, 15);
    a[2] = __builtin_shufflevector(high[0], high[1], 0, 1, 8, 9, 4, 5, 12, 13);
    a[3] = __builtin_shufflevector(high[0], high[1], 2, 3, 10, 11, 6, 7, 14, 15);
    for (int i = 0; i < 4; i++) {
        row[i] = __builtin_shufflevector(a[i], a[i], 0, 1, 2, 3);
        row[i + 4] = __builtin_shufflevector(a[i], a[i], 4, 5, 6, 7);
    }
}

/* The lanes where the mask is true: bit l is lane l. */
static inline unsigned lanes_bits(lane_mask m)
{
#ifdef __AVX__
    typedef float vector __attribute__((vector_size(LANES * sizeof(float))));
    return (unsigned)__builtin_ia32_movmskps256((vector)m);
#else
    unsigned bits = 0;
    for (int l = 0; l < LANES; l++) bits |= ((unsigned)m[l] & 1u) << l;
    return bits;
#endif
}

static inline float lanes_sum(lanes x) { return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7])); }

#endif
