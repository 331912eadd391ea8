/* Random numbers for tests that walk the registries: one stream for each model, which follows from the model's id. A
 * new model therefore changes the points and directions of no other one. */
#ifndef SELVEDGE_TESTS_MODEL_STREAM_H
#define SELVEDGE_TESTS_MODEL_STREAM_H

#include "base/rng.h"

/* Starts the stream of the model `id` in the test that is called `seed`. */
static inline void model_stream_start(struct rng *r, uint32_t seed, const char *id)
{
    uint32_t hash = 2166136261u; /* FNV-1a (Fowler, Noll and Vo) */
    for (const char *c = id; *c != '\0'; c++) hash = (hash ^ (uint8_t)*c) * 16777619u;
    rng_start(r, &(struct rng_key){.seed = (uint64_t)hash << 32 | seed}, 0, 0);
}

#endif
