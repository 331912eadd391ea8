/* Counter-based random numbers: Philox4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3")
 * from the Random123 library.
 *
 * A stream is identified by (seed, iteration, replica, configuration, pixel, sample) and does not depend on any
 * thread state, so results do not depend on how the work is divided among threads. Numbers within a stream come in
 * order of use. A stream is plain data without resources of its own and may be on the stack. */
#ifndef SELVEDGE_BASE_RNG_H
#define SELVEDGE_BASE_RNG_H

/* Philox uses no vector instructions; without them Random123 does not read 45,000 lines of the compiler's headers. */
#define R123_USE_SSE 0
#include <Random123/philox.h>
#include <stdint.h>

struct rng_key {
    uint64_t seed;
    uint32_t iteration;     /* 0..65535 */
    uint32_t replica;       /* 0..15 */
    uint32_t configuration; /* 0..4095 */
};

struct rng {
    philox4x32_key_t key;
    philox4x32_ctr_t counter; /* counter.v[0] counts blocks of four numbers */
    philox4x32_ctr_t block;
    uint32_t n_left;
};

/* Starts the stream of one sample of one pixel. Key fields beyond their ranges wrap, so the caller checks them. */
static inline void rng_start(struct rng *r, const struct rng_key *k, uint32_t pixel, uint32_t sample)
{
    r->key.v[0] = (uint32_t)k->seed;
    r->key.v[1] = (uint32_t)(k->seed >> 32);
    r->counter.v[0] = 0;
    r->counter.v[1] = sample;
    r->counter.v[2] = pixel;
    r->counter.v[3] = (k->iteration << 16) | ((k->replica & 15u) << 12) | (k->configuration & 4095u);
    r->n_left = 0;
}

static inline uint32_t rng_u32(struct rng *r)
{
    if (r->n_left == 0) {
        r->block = philox4x32(r->counter, r->key);
        r->counter.v[0]++;
        r->n_left = 4;
    }
    return r->block.v[--r->n_left];
}

/* Returns a number uniform in [0, 1) with 24 random bits; it is never 1.0f. */
static inline float rng_float(struct rng *r) { return (float)(rng_u32(r) >> 8) * 0x1p-24f; }

/* Returns a number uniform in [0, 1) with 53 random bits. */
static inline double rng_double(struct rng *r)
{
    uint64_t hi = rng_u32(r) >> 5, lo = rng_u32(r) >> 6;
    return (double)((hi << 26) | lo) * 0x1p-53;
}

/* Draws two independent standard normal deviates by the Box-Muller method. */
void rng_normal_pair(struct rng *r, double out[2]);

/* Draws a Poisson deviate with the given mean (>= 0): by inversion below 30, by Hoermann's PTRS above. */
uint64_t rng_poisson(struct rng *r, double mean);

#endif
