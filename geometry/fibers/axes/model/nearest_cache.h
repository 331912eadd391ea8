/* Nearest segments of bricks (nearest_segment.h) that are cached from one round of a fit to the next. */
#ifndef SELVEDGE_GEOMETRY_NEAREST_CACHE_H
#define SELVEDGE_GEOMETRY_NEAREST_CACHE_H

#include "geometry/fibers/axes/model/nearest_segment.h"

#include <stdatomic.h>

/* The voxels of a brick by their nearest segments, as in struct nearest_segments. */
struct nearest_list {
    const uint16_t *cell;
    const uint32_t *first;
};

/* Lists of the bricks as far as there is room. Bricks may be added at a time, each by one thread. */
struct nearest_cache {
    size_t n_brick, most_bytes;
    atomic_size_t n_bytes;
    struct stored_nearest {
        uint16_t *cell;
        uint32_t *first; /* NULL: the list of this brick is not cached */
    } * brick;
};

/* Makes an empty cache for n_brick bricks, which holds at most most_bytes. Returns false when memory is out. */
bool nearest_cache_init(struct nearest_cache *s, size_t n_brick, size_t most_bytes);
/* Accepts a cache that is all zero. */
void nearest_cache_release(struct nearest_cache *s);
/* Adds a copy of the list of a brick with n_segment segments, if there is room and memory for it. */
void nearest_cache_add(struct nearest_cache *s, size_t i_brick, const struct nearest_list *nearest, size_t n_segment);
/* Finds the list of a brick. Returns false if it is not cached. */
bool nearest_cache_find(const struct nearest_cache *s, size_t i_brick, struct nearest_list *nearest);

#endif
